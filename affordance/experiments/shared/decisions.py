"""Choices of a grip of a tool never held, and the proportion of correct ones, for Simulations III and IV.

The correct grip is the one of least work in simulations of the real objects without errors of vision, arm or sensors,
however features are observed and whatever faults are active while observers learn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice
from affordance.choice.picking import NO_OPTION, TIE, Chosen, pick_cheapest
from affordance.choice.ranking import rank_options
from affordance.exceptions import BadValueError
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.recall import recall
from affordance.files.netcdf import LabelledArray
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, is_symmetric
from affordance.proprioception.faults import NO_FAULTS
from affordance.reporting import figures
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import Estimate, estimate_proportion
from affordance.runs.random_streams import Stream
from affordance.settings import Settings
from affordance.vision.features import FeatureSource, VisionError


class SimulatedTask(Protocol):
    """Simulation of a task."""

    @property
    def work(self) -> float:
        """Absolute work of the joints, [J]."""


def remove_errors(settings: Settings) -> Settings:
    """Returns settings without errors: true features, arm and sensors without a fault."""
    return replace(settings, feature_source=FeatureSource.FEATURES, vision_error=VisionError(), faults=NO_FAULTS)


def find_cheaper_grip(simulated: Mapping[str, SimulatedTask]) -> str:
    """Returns the name of the grip of least absolute work; all grips are known to complete the task."""
    return min(simulated, key=lambda grip: simulated[grip].work)


def check_one_grip_is_cheaper(path: Path, tool: Tool, works: Sequence[float]) -> None:
    """Raises a BadValueError if the two cheapest grips of a tool cost the same, as neither would be correct."""
    cheapest, second, *others = sorted(works)
    if second <= cheapest * (1.0 + TIE):
        grips = "both grips" if not others else f"two of its {len(works)} grips"
        problem = f"costs {cheapest:g} J in {grips}, must have a cheaper one"
        raise BadValueError(path, f"tools: {tool.name}", problem)


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Returns the name of the grip with the densest material nearest to the hand, or farthest from it."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip: measure(held) for grip, held in tool.list_gripped().items()}
    return (min if at_hand else max)(distances, key=distances.__getitem__)


# Number of choices before any experience, all drawn from the one prior.
NUM_PRIOR_CHOICES = 10_000
# Number of densities over which the work of each option is averaged.
NUM_BAYES_SAMPLES = 2_000


def choose_before_experience(choice: Choice, colours: tuple[Colour, ...], seed: int) -> Chosen:
    """Chooses by the paper's rule under many densities drawn from the prior, (NUM_PRIOR_CHOICES,)."""
    rng = np.random.default_rng([seed, Stream.PRIOR])
    memory = MaterialMemory().add_colours(colours, choice.settings.prior)
    return pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, NUM_PRIOR_CHOICES)), rng)


def choose_by_sample(
    choice: Choice, experience: Experience, seed: int, repeat: int, moments: Sequence[int] | None = None
) -> Chosen:
    """Chooses by the paper's rule, one density per choice, after numbers of trials: 0 to K unless given."""
    parameters = []
    for trial in range(experience.num_trials + 1) if moments is None else moments:
        rng = np.random.default_rng([seed, repeat, trial, Stream.PAPER])
        parameters.append(choice.draw_parameters(recall(experience, repeat, trial), rng, 1))
    rng = np.random.default_rng([seed, repeat, Stream.PAPER])
    return pick_cheapest(choice.compute_costs(np.concatenate(parameters, axis=1)), rng)


def choose_by_expectation(
    choice: Choice, experience: Experience, seed: int, repeat: int
) -> tuple[Chosen, NDArray[np.bool_]]:
    """Chooses by least expected absolute work, before the first and after each trial, (K + 1,).

    A second array is true where the least expected integral of |tau|^2 would choose otherwise.
    """
    chosen, flips = [], []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, Stream.BAYES])
        ranking = rank_options(choice, recall(experience, repeat, trial), rng, NUM_BAYES_SAMPLES)
        usable = ranking.num_usable > 0
        chosen.append(choice.options.index(ranking.best.option) if usable else NO_OPTION)
        flips.append(ranking.flips)
    return np.array(chosen), np.array(flips)


def let_observer_choose(
    choices: Sequence[Choice], experience: Experience, seed: int, repeat: int
) -> dict[str, NDArray[Any]]:
    """Lets an observer choose a grip of each of G tools before the first and after each of K trials.

    Returns: Indices of the chosen grips: ``paper`` by the paper's rule, (G, K + 1), and ``bayes`` for the first tool
        by least expected work, (K + 1,); and ``flips``, True where the least expected integral of |tau|^2 would
        choose otherwise, (K + 1,).
    """
    bayes, flips = choose_by_expectation(choices[0], experience, seed, repeat)
    paper = np.stack([choose_by_sample(choice, experience, seed, repeat) for choice in choices])
    return {"paper": paper, "bayes": bayes, "flips": flips}


def count_correct(chosen: Chosen, correct: int) -> Array:
    """Counts correct choices over the first axis; a choice without a usable option counts a half, as a guess."""
    guesses = 0.5 * (chosen == NO_OPTION)
    counted: Array = ((chosen == correct) + guesses).sum(axis=0)
    return counted


def estimate_correct(chosen: Chosen, before: Chosen | None, correct: int) -> Estimate:
    """Estimates the proportion of correct choices, with Wilson intervals, each (K + 1,).

    Choices of all observers, (repeats, K + 1), are compared with the index of the correct option. Choices drawn from
    the prior, (N,), if given, replace those before the first trial.
    """
    estimate = estimate_proportion(count_correct(chosen, correct), len(chosen))
    if before is None:
        return estimate
    first = estimate_proportion(count_correct(before, correct), len(before))
    return Estimate(*(np.concatenate([[a], b[1:]]) for a, b in zip(first, estimate, strict=True)))


def label_choices(arrays: Mapping[str, NDArray[Any]]) -> dict[str, LabelledArray]:
    """Labels the choices of all observers for the file of trajectories."""
    meaning = "index of the grip chosen, -1 if none can be used"
    return {
        "chosen": LabelledArray(
            ("repeat", "tool", "moment"), arrays["paper"], "1", f"{meaning}; one density drawn a choice"
        ),
        "chosen_by_expectation": LabelledArray(
            ("repeat", "moment"), arrays["bayes"], "1", f"{meaning}; least expected absolute work, first tool"
        ),
    }


def compute_proportions(
    novel: Sequence[Tool],
    choices: Mapping[str, Choice],
    simulated: Mapping[str, Mapping[str, SimulatedTask]],
    off_axis: Mapping[str, float],
    arrays: Mapping[str, NDArray[Any]],
    experience: ExperienceConfig,
) -> dict[str, Any]:
    """Computes the proportions of correct choices from the arrays of ``let_observer_choose`` of all observers."""
    correct = {name: find_cheaper_grip(done) for name, done in simulated.items()}
    tools: dict[str, dict[str, Any]] = {}
    for index, (name, choice) in enumerate(choices.items()):
        grips = [option.grip for option in choice.options]
        works = {grip: done.work for grip, done in simulated[name].items()}
        before = choose_before_experience(choice, experience.colours, experience.seed)
        estimate = estimate_correct(arrays["paper"][:, index], before, grips.index(correct[name]))
        tools[name] = {
            "p_correct": estimate.mean,
            "p_correct_ci95": estimate.ci95,
            "correct_grip": correct[name],
            "energy_true": works,
            "chance": estimate.mean[0],
            "chance_by_symmetry": is_symmetric(novel[index]),
            "energy_ratio_true": max(works.values()) / min(works.values()),
            "off_axis_2mm_change": off_axis[name],
        }
    first, *others = choices
    grips = [option.grip for option in choices[first].options]
    bayes = estimate_correct(arrays["bayes"], None, grips.index(correct[first]))
    numbers = {
        "p_correct": tools[first]["p_correct"],
        "p_correct_ci95": tools[first]["p_correct_ci95"],
        "p_correct_bayes": bayes.mean,
        "p_correct_bayes_ci95": bayes.ci95,
        "effort_flips": arrays["flips"].mean(axis=0),
        "correct_grip": correct[first],
        "energy_ratio_true": tools[first]["energy_ratio_true"],
        "tools": tools,
        "off_axis_2mm_change": max(off_axis.values()),
    }
    if others:
        second = tools[others[0]]
        numbers["p_correct_headed_tool"] = second["p_correct"]
        numbers["p_correct_headed_tool_ci95"] = second["p_correct_ci95"]
        numbers["correct_grip_headed_tool"] = second["correct_grip"]
        numbers["energy_true_headed_tool"] = second["energy_true"]
    return numbers


def describe_tools(tools: Sequence[Tool], numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the facts about the tools that section files name."""
    effort = numbers["effort_true"]
    return {
        "first": tools[0].name,
        "others": [tool.name for tool in tools[1:]],
        "materials": {
            tool.name: list(dict.fromkeys(part.material.name for part in tool.components)) for tool in tools
        },
        "num_trials": len(numbers["p_correct"]) - 1,
        "least_effort_grip": min(effort, key=effort.__getitem__),
    }


def draw_proportions(tools: Sequence[Tool], numbers: Mapping[str, Any], title: str, num_observers: int) -> Figure:
    """Draws the proportions of correct choices, figures 8 and 10."""
    estimates = {
        name: Estimate(each["p_correct"], *np.moveaxis(each["p_correct_ci95"], -1, 0))
        for name, each in numbers["tools"].items()
    }
    bayes = Estimate(numbers["p_correct_bayes"], *np.moveaxis(numbers["p_correct_bayes_ci95"], -1, 0))
    first, *others = estimates
    rules = {
        "the paper's rule: one density is drawn": estimates[first],
        "work expected over the whole belief": bayes,
    }
    panels = {tools[0].name: rules}
    if others:
        panels["other tools"] = {name: estimates[name] for name in others}
    return figures.draw_choices(panels, title=f"{title}, {count_observers(num_observers)}, 95 % intervals")
