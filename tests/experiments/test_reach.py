"""Simulation III: few observers."""

import dataclasses

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.results_files import read_section, render
from helpers.short_holds import plan_roughly

from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import ControlCounts
from affordance.exceptions import BadValueError
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.gain_experience import collect_experience
from affordance.simulation.rollout import Rollout
from affordance.simulation.trial_record import TrialRecord

TOOLS = ["stick", "hammer"]


@pytest.fixture(scope="module")
def name():
    return "reach"


def test_chance_of_the_stick_is_by_symmetry(folder, numbers):
    assert max(numbers["path_error_m"].values()) < 0.02
    tools, rules = read_section(folder).tables
    assert [row[0] for row in tools["rows"] if any("(by symmetry)" in cell for cell in row)] == ["stick"]
    assert len(rules["rows"]) == 3


def test_correct_grip_is_not_the_densest_ones_where_it_is_not(experiment, plan, numbers):
    claims = {claim.key: claim for claim in render(experiment, plan, numbers, correct_grip="wood").claims}
    assert not claims["correct_grip"].met
    (criterion,) = claims["correct_grip"].criteria
    assert float(criterion.value) < 1.0


def test_other_measure_of_effort_agrees_or_not(experiment, plan, numbers):
    for effort, word in (({"wood": 2.0, "steel": 1.0}, "agrees"), ({"wood": 1.0, "steel": 2.0}, "does not agree")):
        remarks = render(experiment, plan, numbers, effort_true=effort).remarks
        assert any(f"measure of effort, {word} with the absolute work" in remark for remark in remarks)


def test_those_who_know_the_materials_choose_alike(experiment, plan, tmp_path):
    """After six trials a sampled density and the expectation lead to the grip that is truly cheaper."""
    experience = collect_experience(experiment.experience, tmp_path, repeats=1, jobs=1)
    arrays = experiment.run_observer(experiment.select_shared(plan), experience, 0)
    assert arrays["flips"].shape == (7,)
    assert arrays["paper"].shape == (len(TOOLS), 7)
    for chosen in (arrays["paper"][0], arrays["bayes"]):
        assert plan.choices["stick"].options[chosen[-1]].grip == "steel"


WOOD, STEEL = "      wood: {position: [0, 0, 0]}\n", "      steel: {position: [0.30, 0, 0], rpy_deg: [0, 0, 180]}\n"


def test_tools_may_have_grips_of_different_names(models):
    change_file(models / "tools" / "novel.yaml", WOOD, WOOD.replace("wood", "oak"))
    novel = load_choice_experiment("reach", models).novel
    assert [grip.name for grip in novel[0].grips] == ["oak", "steel"]


@pytest.fixture
def asks_for_honest_tools(models):
    """Models whose protocol of reaching does not ask for two grips."""
    change_file(models / "protocols" / "reach.yaml", "require: [two grips, honest]", "require: [honest]")
    return models


def test_tool_of_three_grips_makes_the_experiment(asks_for_honest_tools):
    three = f"{WOOD}{STEEL}      near: {{position: [0.02, 0, 0]}}\n"
    change_file(asks_for_honest_tools / "tools" / "novel.yaml", WOOD + STEEL, three)
    experiment = load_choice_experiment("reach", asks_for_honest_tools)
    experiment = dataclasses.replace(experiment, novel=experiment.novel[:1])
    plan = plan_roughly(experiment)
    arrays = {"paper": np.full((2, 1, 7), 2), "bayes": np.full((2, 7), 2), "flips": np.zeros((2, 7))}
    numbers = experiment.compute_metrics(plan, None, arrays)
    assert numbers["energy_true"].keys() == {"wood", "steel", "near"}
    assert numbers["correct_grip"] == min(numbers["energy_true"], key=numbers["energy_true"].get)
    assert not numbers["tools"]["stick"]["chance_by_symmetry"]
    assert render(experiment, plan, numbers).tables[0].rows[0][0] == "stick"


def test_tool_of_one_grip_is_refused_before_anything_is_planned(asks_for_honest_tools):
    change_file(asks_for_honest_tools / "tools" / "novel.yaml", WOOD + STEEL, WOOD)
    with pytest.raises(BadValueError, match=r"novel.yaml: tools: stick.grips: has 1 entries, must have at least 2"):
        load_choice_experiment("reach", asks_for_honest_tools)


def make_rollout(work, effort, error, limited):
    path, reference = np.array([[0.0, 0.0, 0.0], [0.0, error, 0.0]]), np.zeros((2, 3))
    nothing = np.zeros((2, 1))
    record = TrialRecord(
        nothing[:, 0], *[nothing] * 3, *[nothing[:, 0]] * 3, MaterialMemory(), 0.0, ControlCounts(limited, 0)
    )
    return Rollout(work, effort, path, reference, record)


def test_numbers_are_those_of_made_up_arrays(experiment, plan):
    """Made-up arrays, by which wood is right for the stick and steel for the hammer, give the numbers by hand.

    Before experience the choice with the stick is at chance level, and that with the hammer is not.
    """
    simulated = {
        **plan.simulated,
        "stick": {"wood": make_rollout(8.0, 300.0, 0.01, 4), "steel": make_rollout(10.0, 200.0, 0.02, 5)},
        "hammer": {"wood": make_rollout(9.0, 300.0, 0.0, 0), "steel": make_rollout(6.0, 200.0, 0.0, 0)},
    }
    of_stick = np.array([[1, 0, 0], [1, 1, 0], [1, 0, -1], [1, 0, -1]])
    of_hammer = np.array([[0, 1, 1], [0, 1, 0], [0, 1, 0], [0, 1, -1]])
    arrays = {
        "paper": np.stack([of_stick, of_hammer], axis=1),
        "bayes": np.array([[0, 1, 1], [0, 1, 1], [0, 0, 1], [1, 1, 1]]),
        "flips": np.array([[True, False, True], [False, False, True], [False, False, True], [False, True, True]]),
    }
    numbers = experiment.compute_metrics(plan._replace(simulated=simulated), None, arrays)
    assert (numbers["correct_grip"], numbers["correct_grip_headed_tool"]) == ("wood", "steel")
    assert numbers["p_correct"][0] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(10_000))
    assert numbers["p_correct_headed_tool"][0] > 0.8
    assert numbers["p_correct"][1:].tolist() == [0.75, 0.75]
    assert numbers["p_correct_bayes"].tolist() == [0.75, 0.25, 0.0]
    assert numbers["p_correct_headed_tool"][1:].tolist() == [1.0, 0.375]
    for key in ("p_correct", "p_correct_bayes", "p_correct_headed_tool"):
        low, high = numbers[f"{key}_ci95"].T
        assert (low <= numbers[key]).all()
        assert (numbers[key] <= high).all()
    for tool, key in (("stick", "p_correct"), ("hammer", "p_correct_headed_tool")):
        np.testing.assert_array_equal(numbers["tools"][tool]["p_correct"], numbers[key])
        assert numbers["tools"][tool]["chance"] == numbers[key][0]
    assert list(numbers["tools"]) == TOOLS
    assert [name for name, tool in numbers["tools"].items() if tool["chance_by_symmetry"]] == ["stick"]
    assert [numbers["tools"][name]["energy_ratio_true"] for name in TOOLS[:2]] == [1.25, 1.5]
    assert numbers["off_axis_2mm_change"] == max(tool["off_axis_2mm_change"] for tool in numbers["tools"].values())
    assert numbers["effort_flips"].tolist() == [0.25, 0.25, 1.0]
    assert numbers["energy_ratio_true"] == 1.25
    assert numbers["energy_true"] == {"wood": 8.0, "steel": 10.0}
    assert numbers["energy_true_headed_tool"] == {"wood": 9.0, "steel": 6.0}
    assert numbers["effort_true"] == {"wood": 300.0, "steel": 200.0}
    assert numbers["path_error_m"] == {"wood": 0.01, "steel": 0.02}
    assert numbers["periods_limited"] == {"wood": 4, "steel": 5}
    assert numbers["density_true"] == {"beech": 720.0, "steel": 7850.0}


def tell(section):
    """Full text of a section."""
    figures = [figure.caption for figure in section.figures]
    return "\n".join([section.summary, *figures, *(table.caption for table in section.tables), *section.remarks])


def test_text_is_about_the_tools_that_there_are(experiment, plan, numbers):
    """Texts about one tool, with a name that begins with a pronoun and unlike ends, say nothing of other tools."""
    _, hammer, *_ = experiment.novel
    own = dataclasses.replace(hammer, name="my hammer")
    alone = dataclasses.replace(experiment, novel=(own,))
    told = {"my hammer": numbers["tools"]["hammer"]}
    text = tell(render(alone, plan, {**numbers, "tools": told}))
    assert "which end of my hammer to hold" in text
    assert "My hammer by two rules" in text
    for wrong in ("the my", "The my", "also choose", "both ends look alike", "of the others", "about ."):
        assert wrong not in text
    whole = tell(render(experiment, plan, numbers))
    assert "They also choose about hammer" in whole
    assert "Of the stick both ends look alike, so that chance is a half by symmetry; of the others" in whole
