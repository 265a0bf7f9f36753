"""How often observers choose the cheaper grip of an object they never held: what simulations III and IV share."""

import functools
from collections.abc import Hashable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.options import list_options
from affordance.choice.ranking import NO_OPTION, Choice, Chosen, TaskCostModel, pick_cheapest
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.novel_objects import NovelObjects
from affordance.files.netcdf import Labelled
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.proprioception.faults import NO_FAULTS
from affordance.random_streams import Stream
from affordance.reporting import figures
from affordance.reporting import statistics as metrics
from affordance.reporting.statistics import Estimate
from affordance.settings import Settings

# Choices before any experience are all drawn from the one prior (design 6).
NUM_PRIOR_CHOICES = 10_000
# Densities over which Bayes' rule averages the work of each option.
NUM_BAYES_SAMPLES = 2_000


class Task(TaskCostModel, Hashable, Protocol):
    """A task that can be asked of any option; plans are kept by it."""


class Choices(NamedTuple):
    """The choices of a grip for the plain and the headed object."""

    plain: Choice
    headed: Choice


def plan_choices(novel: NovelObjects, task: Task, settings: Settings, seed: int) -> Choices:
    """Plans a task with each grip of each object; see ``plan_choice``."""
    return Choices(*(plan_choice(tool, task, settings, seed) for tool in (novel.plain, novel.headed)))


def plan_choice(tool: Tool, task: Task, settings: Settings, seed: int) -> Choice:
    """Plans a task with each grip of a tool; one look at it, drawn from the seed, serves all observers.

    Raises:
        AffordanceError: It cannot be planned.
    """
    return _plan_choice(tool, task, replace(settings, faults=NO_FAULTS), seed)  # inner simulation knows of none


@functools.lru_cache(maxsize=8)  # loading plans to refuse what cannot be done, running to choose
def _plan_choice(tool: Tool, task: Task, settings: Settings, seed: int) -> Choice:
    return Choice(list_options(tool, seed=seed, feature_source=settings.feature_source), task, settings)


def choose_before_experience(choice: Choice, colours: tuple[Colour, ...], seed: int) -> Chosen:
    """Chooses by the paper's rule for many densities drawn from the prior, (NUM_PRIOR_CHOICES,)."""
    rng = np.random.default_rng([seed, Stream.PRIOR])
    memory = MaterialMemory().add_colours(colours, choice.settings.prior)
    return pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, NUM_PRIOR_CHOICES)), rng)


def choose_by_sample(choice: Choice, experience: Experience, seed: int, repeat: int) -> Chosen:
    """Chooses by the paper's rule, one density drawn a choice, before the first and after each trial, (K + 1,)."""
    parameters = []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, Stream.PAPER])
        parameters.append(choice.draw_parameters(experience.recall(repeat, trial), rng, 1))
    rng = np.random.default_rng([seed, repeat, Stream.PAPER])
    return pick_cheapest(choice.compute_costs(np.concatenate(parameters, axis=1)), rng)


def choose_by_expectation(
    choice: Choice, experience: Experience, seed: int, repeat: int
) -> tuple[Chosen, NDArray[np.bool_]]:
    """Chooses by least expected work, before the first and after each trial.

    Returns: The choices, and whether the least expected integral of |tau|^2 would choose otherwise, (K + 1,) each.
    """
    chosen, flips = [], []
    for trial in range(experience.num_trials + 1):
        rng = np.random.default_rng([seed, repeat, trial, Stream.BAYES])
        ranking = choice.rank(experience.recall(repeat, trial), rng, NUM_BAYES_SAMPLES)
        usable = ranking.num_usable > 0
        chosen.append(choice.options.index(ranking.best.option) if usable else NO_OPTION)
        flips.append(ranking.flips)
    return np.array(chosen), np.array(flips)


def run_repeat(choices: Choices, experience: Experience, seed: int, repeat: int) -> dict[str, NDArray[Any]]:
    """Lets an observer choose before the first and after each trial.

    Returns: Index of the grip chosen, (K + 1,) each: ``paper`` and ``bayes`` for the plain object by both rules,
        ``headed`` for the headed one by the paper's; and ``flips``, whether the second would choose otherwise by the
        least integral of |tau|^2.
    """
    bayes, flips = choose_by_expectation(choices.plain, experience, seed, repeat)
    return {
        "paper": choose_by_sample(choices.plain, experience, seed, repeat),
        "bayes": bayes,
        "flips": flips,
        "headed": choose_by_sample(choices.headed, experience, seed, repeat),
    }


def compute_proportions(
    choices: Choices,
    arrays: Mapping[str, NDArray[Any]],
    experience: ExperienceConfig,
    correct: int,
    correct_headed: int,
) -> dict[str, Any]:
    """Computes the proportions of correct choices of the results contract.

    Args:
        choices: The choices of a grip.
        arrays: Choices of all observers, (repeats, K + 1) each; see ``run_repeat``.
        experience: How experience was gained.
        correct: Index of the correct grip of the plain object.
        correct_headed: The same of the headed one.
    """
    colours, seed = experience.colours, experience.seed
    before, before_headed = (choose_before_experience(choice, colours, seed) for choice in choices)
    paper = estimate_correct(arrays["paper"], before, correct)
    bayes = estimate_correct(arrays["bayes"], None, correct)
    of_headed = estimate_correct(arrays["headed"], before_headed, correct_headed)
    return {
        "p_correct": paper.mean,
        "p_correct_ci95": paper.ci95,
        "p_correct_bayes": bayes.mean,
        "p_correct_bayes_ci95": bayes.ci95,
        "p_correct_headed_tool": of_headed.mean,
        "p_correct_headed_tool_ci95": of_headed.ci95,
        "effort_flips": arrays["flips"].mean(axis=0),
    }


def draw_proportions(novel: NovelObjects, numbers: Mapping[str, Any], title: str) -> Figure:
    """Draws the proportions of correct choices, figures 8 and 10."""
    curves = {
        f"{novel.plain.name}, one density drawn (paper)": "p_correct",
        f"{novel.plain.name}, least expected work": "p_correct_bayes",
        f"{novel.headed.name}, one density drawn": "p_correct_headed_tool",
    }
    return figures.draw_choices(
        {label: Estimate(numbers[key], *np.moveaxis(numbers[f"{key}_ci95"], -1, 0)) for label, key in curves.items()},
        title=title,
    )


def describe_headed(numbers: Mapping[str, Any]) -> str:
    """Says what the shape of the headed object alone leads to."""
    right, (low, high) = numbers["p_correct_headed_tool"][0], numbers["p_correct_headed_tool_ci95"][0]
    if low <= 0.5 <= high:
        meaning = "its shape alone does not say which"
    else:
        meaning = f"its shape alone speaks for the {'right' if right > 0.5 else 'other'} grip"
    return f"before any experience {100 * right:.0f} of 100 choices of its grip are correct; {meaning}"


def describe_rules(numbers: Mapping[str, Any]) -> str:
    """Says what the other rule chooses."""
    before, *after = numbers["p_correct_bayes"]
    return (
        f"By the rule of least expected work {before:.2f} of the choices are correct before, and after each trial "
        + ", ".join(f"{value:.2f}" for value in after)
        + "; the paper's rule draws one density."
    )


def describe_effort(numbers: Mapping[str, Any]) -> str:
    """Says what the other measure of effort leads to."""
    effort = numbers["effort_true"]
    agrees = min(effort, key=effort.__getitem__) == numbers["correct_grip"]
    flips = ", ".join(f"{100 * value:.0f}" for value in numbers["effort_flips"])
    return (
        f"The integral of |tau|^2, another measure of effort, {'agrees' if agrees else 'does not agree'} with the "
        f"work on the correct grip: {list_by_grip(effort, 'N^2 m^2 s', 0)}. Before the first and after each trial "
        f"its expectation would have led to another choice than that of the work in {flips} of 100 cases."
    )


def list_by_grip(values: Mapping[str, float], unit: str, digits: int = 2) -> str:
    """Lists a quantity by the grip it is of."""
    return " and ".join(f"{value:.{digits}f} {unit} held by {grip}" for grip, value in values.items())


def label_choices(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Labelled]:
    """Labels the choices of all observers for the file of trajectories."""
    rules = {
        "paper": "one density drawn",
        "bayes": "least expected work",
        "headed": "headed object, one density drawn",
    }
    return {
        f"chosen_{rule}": Labelled(
            ("repeat", "moment"), arrays[rule].astype(float), "1", f"grip chosen, -1 if none can be used: {meaning}"
        )
        for rule, meaning in rules.items()
    }


def count_correct(chosen: Chosen, correct: int) -> Array:
    """Adds correct choices over the first axis; where no option was usable the observer guesses: a half."""
    guesses = 0.5 * (chosen == NO_OPTION)
    counted: Array = ((chosen == correct) + guesses).sum(axis=0)
    return counted


def estimate_correct(chosen: Chosen, before: Chosen | None, correct: int) -> Estimate:
    """Estimates the proportion of correct choices.

    Args:
        chosen: Choices of all observers, (repeats, K + 1).
        before: Choices drawn from the prior, (N,), that stand in for those before the first trial; None to count
            the observers' own.
        correct: Index of the correct option.

    Returns: Proportions with Wilson's interval, each (K + 1,).
    """
    estimate = metrics.estimate_proportion(count_correct(chosen, correct), len(chosen))
    if before is None:
        return estimate
    first = metrics.estimate_proportion(count_correct(before, correct), len(before))
    return Estimate(*(np.concatenate([[a], b[1:]]) for a, b in zip(first, estimate, strict=True)))
