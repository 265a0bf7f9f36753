"""Experiment ``hammer``: few observers."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
from affordance.experiments.hammer.blows import (
    build_choices,
    check_first_crossover,
    execute,
    get_costs,
    list_densities_of_map,
)
from affordance.experiments.hammer.section import describe
from affordance.experiments.shared.novel_objects import hold
from helpers.results_contract import check_results

from affordance.choice.hammer import BlowCost
from affordance.choice.ranking import NO_OPTION
from affordance.exceptions import BadValueError
from affordance.experiments import reach
from affordance.experiments.hammer import experiment as hammer
from affordance.experiments.hammer.work_map import find_crossovers
from affordance.experiments.shared.checks import switch_faults_on
from affordance.experiments.shared.decisions import choose_by_expectation, choose_by_sample
from affordance.experiments.shared.experience import collect_experience
from affordance.files.atomic import write_json
from affordance.files.model_folder import MODELS
from affordance.plant.arm import load_arm
from affordance.plant.arm_model import ArmModel
from affordance.proprioception.faults import Faults
from affordance.vision.features import FeatureSource

CONTRACT = {
    "p_correct": (7,),
    "p_correct_ci95": (7, 2),
    "p_correct_bayes": (7,),
    "p_correct_headed_tool": (7,),
    "energy_ratio_true": (),
    "force_demanded_N": (),
    "force_crossover_N": (),
    "tip_energy": (),
}


@pytest.fixture(scope="module")
def config():
    return hammer.load_config()


@pytest.fixture(scope="module")
def choices(config):
    return build_choices(config)


@pytest.fixture(scope="module")
def folder(config, tmp_path_factory):
    """The whole experiment with two observers, run once."""
    folder = tmp_path_factory.mktemp("results") / "hammer"
    hammer.run(config, folder, repeats=2, jobs=1)
    return folder


@pytest.fixture(scope="module")
def numbers(folder):
    return json.loads((folder / "metrics.json").read_text())


def test_results_keep_the_contract(folder):
    numbers = check_results(folder, CONTRACT, ("figure9", "figure10", "blow", "map", "sensitivity"))
    assert numbers["correct_grip"] in {"steel", "wood"}
    for key in ("energy_true", "force_measured_N", "kinetic_energy_true", "energy_without_raising_true"):
        assert numbers[key].keys() == {"steel", "wood"}


def test_correct_grip_is_the_cheaper_one_of_the_simulated(numbers):
    energy = numbers["energy_true"]
    assert energy[numbers["correct_grip"]] == min(energy.values())
    assert numbers["energy_ratio_true"] == pytest.approx(max(energy.values()) / min(energy.values()))


def test_demanded_force_is_met_with_each_grip(numbers):
    for key in ("force_measured_N", "force_measured_N_headed_tool"):
        for force in numbers[key].values():
            assert force == pytest.approx(numbers["force_demanded_N"], rel=0.15)


def test_energy_is_accounted_for(numbers):
    for grip, work in numbers["energy_true"].items():
        parts = numbers["energy_raising_true"][grip] + numbers["energy_without_raising_true"][grip]
        assert parts == pytest.approx(work)
        assert numbers["tip_energy"] < numbers["kinetic_energy_true"][grip] < work
        swings = numbers["swings"][grip]
        assert swings["least_effort"]["effort"] < swings["least_acceleration"]["effort"]
        assert swings["least_work"]["energy"] < swings["least_acceleration"]["energy"]
        assert swings["least_acceleration"]["energy"] == pytest.approx(work, rel=0.03)


def test_contact_simulation_confirms_that_the_cheaper_grip_changes_at_the_crossover(numbers):
    below, above = numbers["force_crossover_checked"]
    assert below["force_demanded_N"] < numbers["force_crossover_N"] < above["force_demanded_N"]
    cheaper = [min(each["energy_true"], key=each["energy_true"].get) for each in (below, above)]
    assert cheaper == ["steel", "wood"]


def test_forces_are_checked_on_either_side_of_a_crossover_above_the_demanded_force(config, numbers):
    """As it is where so little is demanded that the steel end is the cheaper one."""
    (crossover,) = numbers["force_crossovers_N"]
    lower = dataclasses.replace(config, task=dataclasses.replace(config.task, force=0.95 * crossover))
    plain, model = lower.novel.plain, ArmModel(load_arm(lower.experience.settings.arm))
    stronger = dataclasses.replace(lower.task, force=1.9 * crossover)
    cost_model = {
        grip: stronger.build_cost(model, tool.components, lower.experience.settings)
        for grip, tool in hold(plain).items()
    }
    forces = np.linspace(0.97 * crossover, 1.9 * crossover, 20)
    crossovers = find_crossovers(cost_model, {grip: tool.parameters for grip, tool in hold(plain).items()}, forces)
    checked = check_first_crossover(lower, crossovers, up_to_most=cost_model, forces=forces)
    (below, dealt_below), (above, dealt_above) = checked.items()
    assert below < crossovers[0] < above
    assert lower.task.force < above
    assert [min(dealt, key=lambda grip: dealt[grip].work) for dealt in (dealt_below, dealt_above)] == [
        "steel",
        "wood",
    ]


def test_what_is_true_depends_neither_on_sight_nor_on_faults(config):
    experience = config.experience
    settings = dataclasses.replace(experience.settings, feature_source=FeatureSource.PIXELS)
    other = dataclasses.replace(config, experience=dataclasses.replace(experience, settings=settings))
    other = switch_faults_on(other, Faults(arm_mass_factor=1.05))
    for tool in (config.novel.plain, config.novel.headed):
        assert get_costs(other, tool) == get_costs(config, tool)  # the very same
    executed, again = execute(config, config.novel.plain), execute(other, config.novel.plain)
    for grip, blow in executed.items():
        assert (again[grip].work, again[grip].force) == (blow.work, blow.force)


def test_blows_are_those_of_the_tool_that_is_asked_for(config):
    """Also of one that is equal to another but not it, or none of the novel objects."""
    plain, headed = config.novel.plain, config.novel.headed
    speeds = {
        tool.name: {grip: cost_model.speeds.tolist() for grip, cost_model in get_costs(config, tool).items()}
        for tool in (plain, headed, dataclasses.replace(plain), dataclasses.replace(plain, name="a third"))
    }
    assert speeds["a third"] == speeds[plain.name] != speeds[headed.name]


@pytest.mark.parametrize(
    ("true", "least", "most"),
    [(7850.0, 300.0, 11_340.0), (11_340.0, 300.0, 12_474.0), (19_300.0, 300.0, 21_230.0), (110.0, 100.0, 11_340.0)],
)
def test_map_holds_the_true_density(true, least, most):
    densities = list_densities_of_map(true)
    assert (densities[0], densities[-1]) == pytest.approx((least, most))


def test_share_of_light_ends_is_of_what_was_chosen():
    rho = np.array([[1.0, 2.0], [1.0, 2.0], [2.0, 1.0], [1.0, 2.0]])
    near, far = np.array([0, 1]), np.array([1, 0])
    chosen = np.array([0, 1, 0, NO_OPTION])
    assert hammer.compute_share_of_light_ends(chosen, rho=rho, near=near, far=far) == pytest.approx(1 / 3)


def test_run_without_any_choice_ends_as_others_do(config, numbers, tmp_path):
    nothing = np.full(4, NO_OPTION)
    ends = {"near": np.array([0, 1]), "far": np.array([1, 0])}
    share = hammer.compute_share_of_light_ends(nothing, rho=np.ones((4, 2)), **ends)
    write_json(tmp_path / "metrics.json", {**numbers, "p_light_end_held": share})
    assert json.loads((tmp_path / "metrics.json").read_text())["p_light_end_held"] is None
    section = describe(config, {**numbers, "p_light_end_held": share}, 3)
    assert any("No density drawn from the prior" in difference for difference in section.differences)


def test_words_of_the_section_follow_its_numbers(config, numbers):
    def write(**changes):
        section = describe(config, {**numbers, **changes}, 3)
        return " ".join([section.summary, *section.differences])

    for right, interval, words in (
        (0.3, (0.29, 0.31), "its shape alone speaks for the other grip"),
        (0.7, (0.69, 0.71), "its shape alone speaks for the right grip"),
        (0.5, (0.49, 0.51), "its shape alone does not say which"),
    ):
        assert words in write(p_correct_headed_tool=[right], p_correct_headed_tool_ci95=[interval])
    assert "Verdicts want about 20 observers" in write()
    low, high = numbers["force_crossover_checked"]
    deep = {**high, "travel_m": {"wood": 0.0073, "steel": 0.0071}}
    assert "to drive this nail by 7.3 mm with one blow" in write(force_crossover_checked=[low, deep])
    assert "and again at 200, 300 N" in write(force_crossovers_N=[133.0, 200.0, 300.0])
    assert "the simulated ones do not" in write(force_crossover_checked=[high, deep])
    swings = {
        grip: {
            kind: {"energy": work[kind], "effort": 1.0, "converged": grip == "wood"}
            for kind in ("least_acceleration", "least_work", "least_effort")
        }
        for grip, work in (
            ("wood", {"least_acceleration": 10.0, "least_work": 3.0, "least_effort": 50.0}),
            ("steel", {"least_acceleration": 15.0, "least_work": 2.0, "least_effort": 40.0}),
        )
    }
    words = write(swings=swings)
    assert "with them holding wood is cheaper by 50 %" in words
    assert "3.00 J held by wood and 2.00 J held by steel: holding steel is cheaper by 50 %" in words
    assert "Not all of these searches converged" in words


def test_yielding_nail_is_driven_as_deep_by_the_same_energy(numbers):
    for grip, blow in numbers["yielding_nail"].items():
        assert blow["travel_m"] == pytest.approx(numbers["travel_m"][grip], rel=0.05)


def test_section_says_met_or_not_of_every_claim_and_makes_the_prediction(folder):
    section = json.loads((folder / "section.json").read_text())
    assert len(section["claims"]) == 5
    assert all(isinstance(claim["met"], bool) for claim in section["claims"])
    assert section["differences"][0].startswith(
        "A prediction: whoever has felt both materials will hold the wood end"
    )


def test_claims_are_not_met_by_numbers_that_contradict_them(config, numbers):
    contradicting = {
        "correct_grip": "steel",
        "force_measured_N": {"wood": 300.0, "steel": 430.0},
        "p_correct": np.linspace(0.9, 0.3, 7),
        "p_correct_ci95": np.column_stack([np.linspace(0.8, 0.2, 7), np.linspace(0.95, 0.4, 7)]),
    }
    section = describe(config, {**numbers, **contradicting}, 3)
    assert not any(claim.met for claim in section.claims)


def test_without_a_crossover_nothing_is_predicted(config, numbers):
    section = describe(config, {**numbers, "force_crossover_N": None}, 3)
    assert not any("prediction" in difference for difference in section.differences)


def test_several_crossovers_are_listed(config, numbers):
    section = describe(config, {**numbers, "force_crossovers_N": [129.0, 205.0]}, 3)
    assert any("changes at 129 N" in text and "and again at 205 N" in text for text in section.differences)


def test_order_that_other_swings_turn_around_is_said(config, numbers):
    swings = {grip: {kind: dict(each) for kind, each in kinds.items()} for grip, kinds in numbers["swings"].items()}
    swings["wood"]["least_work"]["energy"] = 1.31 * swings["steel"]["least_work"]["energy"]
    section = describe(config, {**numbers, "swings": swings}, 3)
    assert any("with them holding wood is cheaper" in text for text in section.differences)
    assert any("holding steel is cheaper by 31 %" in text for text in section.differences)


def test_experience_gained_for_reaching_serves_hammering(config, choices, tmp_path):
    """What was learned in one experiment is what is chosen by in the other: the memories are found, not made anew."""
    gained = collect_experience(reach.load_config().experience, tmp_path, repeats=2, jobs=1)
    before = sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz"))
    found = collect_experience(config.experience, tmp_path, repeats=2, jobs=1)
    assert sorted((path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.npz")) == before
    np.testing.assert_array_equal(found.precision, gained.precision)
    # Those who know the materials choose the cheaper grip, by either rule.
    expected, _ = choose_by_expectation(choices.plain, found, 0, 0)
    for chosen in (choose_by_sample(choices.plain, found, 0, 0), expected):
        assert chosen.shape == (7,)
        assert choices.plain.options[chosen[-1]].grip == "wood"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "offset: [-0.1, 0, -0.1]",
            "offset: [0.5, 0, -0.1]",
            r"nail.yaml: blow: cannot be dealt: stick by wood: no swing",
        ),
        (
            "depth_demanded: 0.01722",
            "depth_demanded: 0.05",
            r"nail.yaml: depth_demanded: is 0.05 m and asks for 1240 N, for which with the stick by wood "
            r"wrist_deviation must bear 1.91 times its torque limit; must be at most 0.0267 m",
        ),
        (
            "direction: [0, 0, -1]",
            "direction: [0, 0, 1]",
            r"blow.offset: puts the head -0.1 m ahead .* at least 0.01 m",
        ),
        ("depth_demanded: 0.01722", "depth_demanded: 0.004", r"depth_demanded: is 0.004, must be from 0.005"),
    ],
)
def test_blow_that_cannot_be_dealt_is_refused(tmp_path, old, new, message):
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "nail.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(BadValueError, match=message):
        hammer.load_config(tmp_path / "models")


def test_arm_that_can_drive_no_nail_is_refused_without_a_bound(tmp_path, monkeypatch):
    """An arm that is too weak even for the slowest swing, as the search for the greatest depth would find it."""
    monkeypatch.setattr(BlowCost, "find_greatest_depth", lambda self, pi: self.hammer.nail.depth_set)
    shutil.copytree(MODELS, tmp_path / "models")
    path = tmp_path / "models" / "nail.yaml"
    path.write_text(path.read_text().replace("depth_demanded: 0.01722", "depth_demanded: 0.05"))
    with pytest.raises(BadValueError, match=r"1\.91 times its torque limit; no depth is within the joints' limits$"):
        hammer.load_config(tmp_path / "models")
