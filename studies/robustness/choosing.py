"""Simulations III and IV for a sampled setting: the correct grip, and how often observers choose it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from affordance.belief.material_memory import MaterialMemory
from affordance.choice.blow_cost import BlowCost
from affordance.choice.inner_simulation import Choice, OptionCost
from affordance.choice.motion_cost import Costs, MotionCost
from affordance.choice.picking import MIN_FEASIBILITY, TIE
from affordance.choice.ranking import rank_options
from affordance.control.cost_measure import CostMeasure
from affordance.exceptions import AffordanceError
from affordance.experiments.shared.grips import (
    NUM_PRIOR_CHOICES,
    choose_before_experience,
    compute_probabilities,
    estimate_probability,
    find_grip_of_densest,
)
from affordance.objects.tool import Tool
from affordance.reporting.statistics import Estimate, estimate_proportion
from affordance.runs.random_streams import Stream

# Memories of each observer before the first hold and after each hold.
type Experience = Sequence[Sequence[MaterialMemory]]

# Number of sampled densities for expected costs.
_NUM_BAYES_SAMPLES = 64
# Number of trials before a choice.
MOMENTS = (0, 1, 2, 6)
_NUM_FORCES = 40
_LEAST_FORCE = 1.02


def measure_truth(choice: Choice, tool: Tool, rule: CostMeasure | None = None) -> Costs:
    """Computes the costs of all options at the true densities, (options,) each.

    Args:
        choice: Options and their cost models.
        tool: Tool with true densities.
        rule: Cost measure; None for the measure of the settings.
    """
    held = tool.list_gripped()
    models = choice.cost_models if rule is None else [_measure_by(model, rule) for model in choice.cost_models]
    costs = [
        model.compute(held[option.grip].parameters[None])
        for option, model in zip(choice.options, models, strict=True)
    ]
    return Costs(*(np.array(column)[:, 0] for column in zip(*costs, strict=True)))


def find_correct(costs: Costs) -> int:
    """Finds the index of the cheapest feasible option.

    Raises:
        AffordanceError: No option is feasible, or several are equally cheap.
    """
    cost = np.where(costs.feasible, costs.cost, np.inf)
    if not costs.feasible.any():
        raise AffordanceError("no grip can do it")
    if (cost <= cost.min() * (1.0 + TIE)).sum() > 1:
        raise AffordanceError("no grip is cheaper than the other")
    return int(cost.argmin())


def measure_choices(choice: Choice, tool: Tool, experience: Experience, seed: int, rule: str) -> dict[str, Any]:
    """Computes the results of a task on which claims depend.

    Raises:
        AffordanceError: There is no correct grip.
    """
    costs = measure_truth(choice, tool)
    correct = find_correct(costs)
    cost = np.where(costs.feasible, costs.cost, np.inf)
    if rule == "one sample":
        before = choose_before_experience(choice, experience[0][0].colours, seed)
        right = [
            compute_probabilities(choice, [memories[after] for after in MOMENTS], (seed, observer))[:, correct]
            for observer, memories in enumerate(experience)
        ]
        estimate = estimate_probability(np.array(right), before, correct)
    else:
        estimate = _estimate_by_expectation(choice, experience, seed, correct)
    grips = [option.grip for option in choice.options]
    return {
        "p_correct": estimate.mean,
        "p_correct_ci95": estimate.ci95,
        "energy_ratio_true": float(cost.max() / cost.min()),
        "correct_grip": grips[correct],
        "grip_of_densest": find_grip_of_densest(tool, at_hand=True),
        "grip_of_densest_far": find_grip_of_densest(tool, at_hand=False),
    }


def compare_measures(choice: Choice, tool: Tool) -> dict[str, int]:
    """Finds the index of the correct option for each cost measure.

    Raises:
        AffordanceError: There is no correct grip.
    """
    return {measure.name: find_correct(measure_truth(choice, tool, measure)) for measure in CostMeasure}


def list_blow_costs(choice: Choice) -> dict[str, BlowCost]:
    """Lists the planned blows of a choice, by grip."""
    found = {}
    for option, cost in zip(choice.options, choice.cost_models, strict=True):
        assert isinstance(cost, BlowCost)  # the task is a Hammer
        found[option.grip] = cost
    return found


def find_travel_of_other_grip(choice: Choice, tool: Tool, depth_set: float, stiffness: float, most: float) -> float:
    """Finds the largest travel of the nail for which the grip next to the densest part is cheaper, [m].

    The travel is zero if this grip is not cheaper for any force that both grips can produce.

    Args:
        choice: Options and their cost models.
        tool: Tool with true densities.
        depth_set: Initial depth of the nail, [m].
        stiffness: Stiffness of the nail, [N/m].
        most: Largest force of the nail, [N].
    """
    held = tool.list_gripped()
    at_hand = find_grip_of_densest(tool, at_hand=True)
    largest = 0.0
    for force in np.geomspace(_LEAST_FORCE * stiffness * depth_set, most, _NUM_FORCES):
        costs = {}
        for option, model in zip(choice.options, choice.cost_models, strict=True):
            assert isinstance(model, BlowCost)
            costs[option.grip] = model.compute(held[option.grip].parameters[None], float(force))
        if (
            all(each.feasible[0] for each in costs.values())
            and min(costs, key=lambda grip: float(costs[grip].cost[0])) == at_hand
        ):
            largest = float(force) / stiffness - depth_set
    return largest


def _estimate_by_expectation(choice: Choice, experience: Experience, seed: int, correct: int) -> Estimate:
    """Estimates the fraction of correct choices by expected cost before experience and after some trials."""
    shares = [
        [_choose_by_expectation(choice, memories[after], (seed, observer, after), correct) for after in MOMENTS[1:]]
        for observer, memories in enumerate(experience)
    ]
    after = estimate_proportion(np.sum(shares, axis=0), len(experience))
    share = decide_before_experience(choice, experience, seed, correct)
    before = estimate_proportion(np.array(share * NUM_PRIOR_CHOICES), NUM_PRIOR_CHOICES)
    return Estimate(*(np.concatenate([[first], later]) for first, later in zip(before, after, strict=True)))


def decide_before_experience(choice: Choice, experience: Experience, seed: int, correct: int) -> float:
    """Returns 1 if the correct option has the least expected cost under the prior, 0.5 for a tie, and otherwise 0."""
    rng = np.random.default_rng([seed, Stream.BAYES])
    costs = choice.compute_costs(choice.draw_parameters(experience[0][0], rng, NUM_PRIOR_CHOICES))
    usable = costs.feasible.mean(axis=1) >= MIN_FEASIBILITY
    rivals = np.delete(np.arange(len(usable)), correct)[np.delete(usable, correct)]
    if not usable[correct] or not len(rivals):
        return 0.5 if not usable.any() else float(usable[correct])
    gain = costs.cost[rivals].min(axis=0) - costs.cost[correct]
    error = float(gain.std() / np.sqrt(len(gain)))
    # Differences within two standard errors are ties.
    return 0.5 if abs(gain.mean()) <= 2.0 * error else float(gain.mean() > 0.0)


def _choose_by_expectation(choice: Choice, memory: MaterialMemory, seed: tuple[int, int, int], correct: int) -> float:
    """Returns 1 if an observer chooses the correct option, and otherwise 0. Without usable options, it guesses."""
    ranking = rank_options(choice, memory, np.random.default_rng([*seed, Stream.BAYES]), _NUM_BAYES_SAMPLES)
    if not ranking.num_usable:
        return 0.5
    return float(choice.options.index(ranking.best.option) == correct)


def _measure_by(model: OptionCost, measure: CostMeasure) -> OptionCost:
    """Returns a cost model of the same motions with another measure."""
    if isinstance(model, BlowCost):
        return replace(model, motions=tuple(motion.measured_by(measure) for motion in model.motions))
    assert isinstance(model, MotionCost)  # the task is a Reach
    return model.measured_by(measure)


def measure_tasks(
    by_reach: Mapping[str, int], by_hammer: Mapping[str, int], *, correct_reach: str, correct_hammer: str
) -> dict[str, Any]:
    """Summarises both tasks: correct grips, and agreement between cost measures.

    Args:
        by_reach: Index of the correct grip for reaching, by measure.
        by_hammer: Index of the correct grip for hammering, by measure.
        correct_reach: Correct grip for reaching with the measure of the settings.
        correct_hammer: Correct grip for hammering with the measure of the settings.
    """
    works = (CostMeasure.WORK.name, CostMeasure.POSITIVE_WORK.name, CostMeasure.MUSCULAR_WORK.name)
    return {
        "correct_reach": correct_reach,
        "correct_hammer": correct_hammer,
        "work_measures_agree": [len({by[name] for name in works}) == 1 for by in (by_reach, by_hammer)],
        "effort_differs": by_hammer[CostMeasure.EFFORT.name] != by_hammer[CostMeasure.WORK.name],
    }
