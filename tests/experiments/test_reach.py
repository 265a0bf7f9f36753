"""Simulation III: plans, choices of observers, and words that follow the tools."""

import dataclasses

import numpy as np
import pytest
from helpers.changed_files import change_file
from helpers.results_files import read_section

from affordance.belief.material_memory import MaterialMemory
from affordance.control.systems import ControlCounts
from affordance.exceptions import BadValueError
from affordance.experiments import reach
from affordance.experiments.shared.observers import Setup
from affordance.simulation.rollout import Rollout
from affordance.simulation.trial_record import TrialRecord

TOOLS = ["stick", "hammer"]
WOOD = "      wood: {position: [0, 0, 0]}\n"


def test_chance_of_the_stick_is_by_symmetry(shipped):
    assert max(shipped.numbers["path_error_m"].values()) < 0.02
    tools, rules = read_section(shipped.folder).tables
    assert [row[0] for row in tools["rows"]] == TOOLS
    assert [row[0] for row in tools["rows"] if any("(by symmetry)" in cell for cell in row)] == ["stick"]
    assert len(rules["rows"]) == 4


def test_probabilities_and_shares_are_those_of_all_observers(shipped):
    """Those after the first trial are of the data; that before is of the prior."""
    grips = [*shipped.numbers["energy_true"]]
    for index, tool in enumerate(TOOLS):
        numbers = shipped.numbers["tools"][tool]
        assert numbers["correct_grip"] == min(numbers["energy_true"], key=numbers["energy_true"].get)
        hits = shipped.data.paper.values[:, index] == grips.index(numbers["correct_grip"])
        np.testing.assert_array_equal(numbers["p_correct_drawn"][1:], hits.mean(axis=0)[1:])
        right = shipped.data.probability.values[:, index, :, grips.index(numbers["correct_grip"])]
        np.testing.assert_allclose(numbers["p_correct"][1:], right.mean(axis=0)[1:])
    np.testing.assert_array_equal(shipped.numbers["effort_flips"], shipped.data.flips.values.mean(axis=0))


def test_those_who_know_the_materials_choose_alike(shipped):
    """After six trials a sampled density and the expectation lead to the grip that is truly cheaper."""
    assert shipped.data.paper.shape == (2, 2, 7)
    grips = [*shipped.numbers["energy_true"]]
    for rule in (shipped.data.paper.isel(tool=0), shipped.data.bayes):
        assert [grips[index] for index in rule.isel(moment=-1).values] == ["steel", "steel"]


def test_motions_in_the_data_are_those_that_were_simulated(shipped):
    """The largest distance from the path, in the file of motions, is the error that the numbers state."""
    data = shipped.data
    distances = np.linalg.norm(data.p_WF.values - data.p_WF_reference.values, axis=2).max(axis=1)
    assert distances == pytest.approx([*shipped.numbers["path_error_m"].values()], rel=1e-12)


def test_correct_grip_is_not_the_densest_ones_where_it_is_not(shipped):
    claims = {claim.key: claim for claim in reach.judge({**shipped.numbers, "correct_grip": "wood"}, "steel")}
    assert not claims["correct_grip"].met
    (criterion,) = claims["correct_grip"].criteria
    assert float(criterion.value) < 1.0


def make_rollout(work, effort, error, limited):
    path, reference = np.array([[0.0, 0.0, 0.0], [0.0, error, 0.0]]), np.zeros((2, 3))
    nothing = np.zeros((2, 1))
    record = TrialRecord(
        nothing[:, 0], *[nothing] * 3, *[nothing[:, 0]] * 3, MaterialMemory(), 0.0, ControlCounts(limited, 0)
    )
    return Rollout(work, effort, path, reference, record)


def test_costs_of_made_up_motions_by_hand():
    motions = {"wood": make_rollout(8.0, 300.0, 0.01, 4), "steel": make_rollout(10.0, 200.0, 0.02, 5)}
    assert reach.measure(motions) == {
        "energy_true": {"wood": 8.0, "steel": 10.0},
        "effort_true": {"wood": 300.0, "steel": 200.0},
        "periods_limited": {"wood": 4, "steel": 5},
        "path_error_m": {"wood": 0.01, "steel": 0.02},
    }


def test_tools_may_have_grips_of_different_names(models):
    change_file(models / "tools" / "novel.yaml", WOOD, WOOD.replace("wood", "oak"))
    _, (stick, *_), _ = reach.read(Setup(models=models))
    assert [grip.name for grip in stick.grips] == ["oak", "steel"]


def test_path_that_is_followed_badly_is_refused():
    """A tolerance of a tenth of a millimetre is less than the error of the controller."""
    _, tools, task = reach.read(Setup())
    task = dataclasses.replace(task, path=dataclasses.replace(task.path, tolerance=1e-4))
    with pytest.raises(BadValueError, match=r"reach.yaml: points: cannot be followed: the stick by wood "):
        reach.plan(Setup(), tools[:1], task)


def test_text_is_about_the_tools_that_there_are(shipped):
    assert "chose the end of the stick by which to move" in shipped.summary
    assert "They also chose a grip for: hammer." in shipped.summary
    assert "Both ends of the stick look alike" in shipped.captions["figure8"]
    first, *_, last = shipped.numbers["p_correct"]
    assert f"with a probability of {first:.0%} before anything was held" in shipped.finding
    assert shipped.finding.endswith(f"and {last:.0%} after 6 trials.")
