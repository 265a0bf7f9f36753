"""Simulation IV: few observers."""

import dataclasses
from functools import partial

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.results_files import read_numbers, render
from helpers.short_holds import take_two_tools
from helpers.slow_arm import make_slow_models

from affordance.choice.blow_cost import BlowCost
from affordance.choice.hammer import load_hammer
from affordance.choice.off_axis import list_shifted, measure_change
from affordance.choice.picking import NO_OPTION
from affordance.exceptions import BadValueError
from affordance.experiments.hammer import Hammering, compute_share_of_light_ends, label_blows
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.files.atomic import write_json
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.plant.arm import ARM
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings

TOOLS = ["stick", "hammer"]


@pytest.fixture(scope="module")
def name():
    return "hammer"


def test_demanded_force_is_met_with_each_grip(numbers):
    """Forces on the nail are from 1.0 to 1.1 times the demanded one with each grip."""
    for key in ("force_measured_N", "kinetic_energy_true", "energy_without_raising_true"):
        assert numbers[key].keys() == {"steel", "wood"}
    assert len(numbers["force_ratios"]) == 2 * len(TOOLS)
    assert all(1.0 <= ratio <= 1.1 for ratio in numbers["force_ratios"])
    for key in ("force_measured_N", "force_measured_N_headed_tool"):
        for force in numbers[key].values():
            assert 1.0 <= force / numbers["force_demanded_N"] <= 1.1


def test_energy_is_accounted_for(numbers):
    for grip, work in numbers["energy_true"].items():
        parts = numbers["energy_raising_true"][grip] + numbers["energy_without_raising_true"][grip]
        assert parts == pytest.approx(work)
        assert numbers["tip_energy"] < numbers["kinetic_energy_true"][grip] < work


def test_blows_are_those_of_each_tool(plan):
    speeds = {
        tool: {grip: planned.speeds.tolist() for grip, planned in costs.items()} for tool, costs in plan.costs.items()
    }
    assert list(speeds) == TOOLS
    assert speeds["stick"] != speeds["hammer"]
    for tool, costs in plan.costs.items():
        for grip, cost_model in zip(costs, plan.choices[tool].cost_models, strict=True):
            assert costs[grip] is cost_model or (costs[grip].speeds == cost_model.speeds).all()


def test_share_of_light_ends_is_of_what_was_chosen():
    rho = np.array([[1.0, 2.0], [1.0, 2.0], [2.0, 1.0], [1.0, 2.0]])
    near, far = np.array([0, 1]), np.array([1, 0])
    chosen = np.array([0, 1, 0, NO_OPTION])
    assert compute_share_of_light_ends(chosen, rho=rho, near=near, far=far) == pytest.approx(1 / 3)


def test_trajectories_last_until_the_nail_of_a_heavy_arm_is_at_rest(plan):
    blows = list(plan.simulated["stick"].values())
    usual = label_blows(blows)["time_since_touch"].values
    assert usual[-1] == pytest.approx(0.012, abs=1e-4)
    nail = blows[0].nail
    slow = nail._replace(times=nail.time_of_touch + 4.0 * (nail.times - nail.time_of_touch))
    heavy = dataclasses.replace(blows[0], nail=slow)
    longer = label_blows([heavy])["time_since_touch"].values
    assert longer[-1] > slow.time_of_rest - slow.time_of_touch > 0.012


def test_run_without_any_choice_ends_as_others_do(experiment, plan, numbers, tmp_path):
    nothing = np.full(4, NO_OPTION)
    ends = {"near": np.array([0, 1]), "far": np.array([1, 0])}
    share = compute_share_of_light_ends(nothing, rho=np.ones((4, 2)), **ends)
    write_json(tmp_path / "metrics.json", {**numbers, "p_light_end_held": share})
    assert read_numbers(tmp_path)["p_light_end_held"] is None
    remarks = render(experiment, plan, numbers, p_light_end_held=share).remarks
    assert any("No density drawn from the prior" in remark for remark in remarks)


def find_table(section, title):
    (table,) = (table for table in section.tables if title in table.header)
    return table


def test_words_of_the_section_follow_its_numbers(experiment, plan, numbers):
    section = render(experiment, plan, numbers, p_light_end_held=0.123)
    remarks = " ".join(section.remarks)
    assert section.caution == "Only 3 observers: claims need about 20 or more."
    assert "Of 100 choices by densities from the prior 12.3 grip" in remarks


def test_experience_gained_for_reaching_serves_hammering(experiment, plan, tmp_path):
    """Memories gained for reaching are found for hammering, not made anew, and lead to the cheaper grip."""
    reaching = take_two_tools(load_choice_experiment("reach"))
    gained = collect_experience(reaching.experience, tmp_path, repeats=1, jobs=1)
    before = sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz"))
    found = experiment.gain_experience(tmp_path, repeats=1, jobs=1)
    assert sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz")) == before
    np.testing.assert_array_equal(found.precision, gained.precision)
    np.testing.assert_array_equal(found.information_vector, gained.information_vector)
    # Observers who know the materials choose the cheaper grip, by either rule.
    arrays = experiment.run_observer(experiment.select_shared(plan), found, 0)
    for chosen in (arrays["paper"][0], arrays["bayes"]):
        assert chosen.shape == (7,)
        assert plan.choices["stick"].options[chosen[-1]].grip == "wood"


def test_one_tool_makes_the_experiment(experiment, plan):
    """An experiment about one tool has no numbers, rows or captions about other tools."""
    alone = dataclasses.replace(experiment, novel=experiment.novel[:1])
    only = {"stick": plan.choices["stick"]}
    plan = plan._replace(choices=only, simulated={"stick": plan.simulated["stick"]})
    arrays = {
        "paper": np.zeros((3, 1, 7), dtype=int),
        "bayes": np.zeros((3, 7), dtype=int),
        "flips": np.zeros((3, 7)),
    }
    numbers = alone.compute_metrics(plan, None, arrays)
    assert numbers["tools"].keys() == {"stick"}
    assert not any("headed" in key for key in numbers)
    section = render(alone, plan, numbers)
    assert len(find_table(section, "correct grip").rows) == 1
    assert "also choose" not in section.summary
    assert not any("of the others" in figure.caption for figure in section.figures)


def test_arm_that_can_drive_no_nail_is_rejected_without_a_bound(models, monkeypatch):
    """An arm too weak for the slowest swing is refused without a depth that it could drive the nail to."""
    monkeypatch.setattr(BlowCost, "find_greatest_depth", lambda self, pi: self.nail.depth_set)
    change_file(models / "nail.yaml", "depth_demanded: 0.01722", "depth_demanded: 0.05")
    experiment = load_choice_experiment("hammer", models)
    with pytest.raises(BadValueError, match=r"2\.4 times its torque limit; no depth is within the joints' limits$"):
        dataclasses.replace(experiment, novel=experiment.novel[:1]).plan(jobs=1)


def test_work_is_that_of_the_planned_blow_on_an_arm_of_any_speed(tmp_path, monkeypatch):
    models = make_slow_models(tmp_path)
    settings, task = Settings(arm=models / ARM.name), load_hammer(models / "nail.yaml")
    stick, *_ = load_tools(models / "tools" / "novel.yaml", load_materials(models / "materials.yaml"))
    grip = stick.grips[0]
    held = stick.gripped_by(grip)
    planned = task.build_cost(ArmModel(load_arm(settings.arm)), held.components, settings)
    assert planned.speeds[-1] < 1.0
    compute_work = partial(Hammering(task).compute_work, settings, {stick.name: {grip.name: planned}})
    (expected,) = planned.compute(held.parameters[None]).work
    assert compute_work(held) == pytest.approx(expected, rel=5e-3)
    monkeypatch.setattr("affordance.choice.off_axis.list_shifted", lambda tool: [*list_shifted(tool)][4:6])
    assert 0.0 < measure_change(compute_work, stick, grip) < 0.1
