"""Share of choices of the correct grip, as the simulations count it; ties; and travels of the nail."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers.shared import compute_once
from helpers.two_tools import REACH, STEEL, STICK, WOOD

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import plan_choice
from affordance.choice.listed_options import list_options
from affordance.choice.motion_cost import Costs
from affordance.experiments.shared.grips import (
    NUM_PRIOR_CHOICES,
    choose_before_experience,
    choose_by_sample,
    compute_probabilities,
    estimate_probability,
)
from affordance.reporting.statistics import estimate_proportion
from studies.robustness import choosing
from studies.robustness.choosing import (
    MOMENTS,
    decide_before_experience,
    find_travel_of_other_grip,
    measure_choices,
)

UNSURE, SURE = 1e-7 * np.eye(2), np.eye(2)
CORRECT = 1


@pytest.fixture(scope="module")
def choice(tmp_path_factory):
    return compute_once(tmp_path_factory, "choice_for_robustness", lambda: plan_choice(list_options(STICK), REACH))


@pytest.fixture(scope="module")
def experience():
    """Thirty observers, unsure at first and sure at last, that steel is the denser one."""
    rho = np.array([2500.0, 4000.0])
    memories = [
        MaterialMemory.from_belief((WOOD, STEEL), DensityBelief(precision, precision @ rho))
        for precision in (*[UNSURE] * 3, *[SURE] * 4)
    ]
    return [memories] * 30


def test_choices_are_those_that_the_simulations_count(choice, experience):
    """Probabilities and intervals equal those of the simulations, at each moment, and agree with drawn choices."""
    numbers = measure_choices(choice, STICK, experience, 3, "one sample")
    correct = [option.grip for option in choice.options].index(numbers["correct_grip"])
    chosen = [[memories[after] for after in MOMENTS] for memories in experience]
    right = np.array(
        [compute_probabilities(choice, each, (3, observer))[:, correct] for observer, each in enumerate(chosen)]
    )
    before = choose_before_experience(choice, (WOOD, STEEL), 3)
    assert len(before) == NUM_PRIOR_CHOICES
    counted = estimate_probability(right, before, correct)
    np.testing.assert_array_equal(numbers["p_correct"], counted.mean)
    np.testing.assert_array_equal(numbers["p_correct_ci95"], counted.ci95)
    drawn = choose_by_sample(choice, [experience[0][1]] * 400, (3, 0)) == correct
    assert numbers["p_correct"][1] == pytest.approx(drawn.mean(), abs=4.0 * 0.5 / np.sqrt(400))
    assert 0.3 < numbers["p_correct"][1] < numbers["p_correct"][-1] == 1.0


def test_intervals_by_expectation_are_of_as_many_as_choose(choice, experience):
    numbers = measure_choices(choice, STICK, experience, 3, "expectation")
    share = numbers["p_correct"][1:]
    np.testing.assert_allclose(share * 30, np.round(share * 30), atol=1e-9)
    np.testing.assert_allclose(numbers["p_correct_ci95"][1:], estimate_proportion(share * 30, 30).ci95)
    assert share[-1] == 1.0


class TwoOptions:
    """A choice of which the costs are drawn: the second is cheaper by some gain, with an error of 1."""

    def __init__(self, gain, feasible=(True, True)):
        self.gain, self.feasible = gain, feasible

    def draw_parameters(self, memory, rng, num_samples):
        drawn = rng.standard_normal(num_samples)
        return (drawn - drawn.mean()) / drawn.std()

    def compute_costs(self, drawn):
        cost = np.array([10.0 + self.gain + drawn, np.full(len(drawn), 10.0)])
        feasible = np.broadcast_to(np.array(self.feasible)[:, None], cost.shape)
        return Costs(cost, cost, feasible, cost)


STANDARD_ERROR = 1.0 / np.sqrt(NUM_PRIOR_CHOICES)


@pytest.mark.parametrize(
    ("gain", "share"),
    [
        (0.0, 0.5),
        (1.9 * STANDARD_ERROR, 0.5),
        (-1.9 * STANDARD_ERROR, 0.5),
        (2.1 * STANDARD_ERROR, 1.0),
        (-2.1 * STANDARD_ERROR, 0.0),
    ],
)
def test_options_within_two_standard_errors_are_a_tie_before_experience(experience, gain, share):
    assert decide_before_experience(TwoOptions(gain), experience, 0, CORRECT) == share


@pytest.mark.parametrize(("feasible", "share"), [((True, False), 0.0), ((False, True), 1.0), ((False, False), 0.5)])
def test_option_that_cannot_be_used_is_not_chosen_before_experience(experience, feasible, share):
    assert decide_before_experience(TwoOptions(0.0, feasible), experience, 0, CORRECT) == share


class Blows:
    """Blows that cost 99, and 101 from a force on, where others cost 100."""

    def __init__(self, dear_from):
        self.dear_from = dear_from

    def compute(self, pi, force):
        cost = np.array([101.0 if force >= self.dear_from else 99.0])
        return Costs(cost, cost, np.array([force <= 900.0]), cost)


class Even:
    def compute(self, pi, force):
        return Costs(*(np.array([100.0]),) * 2, np.array([True]), np.array([100.0]))


def test_travel_is_from_where_the_nail_stands(monkeypatch):
    """A nail of 100 kN/m that stands 1 mm deep moves by 2 mm under 300 N, as it resists with 100 N at first."""
    monkeypatch.setattr(choosing, "BlowCost", (Blows, Even))
    tool = STICK
    grips = [option.grip for option in list_options(tool)]
    at_hand = choosing.find_grip_of_densest(tool, at_hand=True)
    models = [Blows(300.0) if grip == at_hand else Even() for grip in grips]
    blows = SimpleNamespace(options=[SimpleNamespace(grip=grip) for grip in grips], cost_models=models)
    travel = find_travel_of_other_grip(blows, tool, 1e-3, 1e5, 800.0)
    assert travel == pytest.approx(2e-3, rel=0.06)  # a grid of forty forces, each 5 % above the one before
    assert travel < 2e-3
    models[:] = [Blows(0.0) if grip == at_hand else Even() for grip in grips]
    assert find_travel_of_other_grip(blows, tool, 1e-3, 1e5, 800.0) == 0.0
