"""Simulates choices of a grip for a novel tool by two rules, and computes shares of correct choices.

The correct grip has the least absolute work in a simulation with the true tool, and without errors of vision, arm or
sensors. These errors affect the features and beliefs of observers, but not the correct grip.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.listed_options import list_options
from affordance.choice.options import Option
from affordance.choice.picking import NO_OPTION, TIE, Chosen, find_chosen, pick_cheapest
from affordance.exceptions import AffordanceError, BadValueError, SeeingError, UnavailableError
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool, is_symmetric
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.proprioception.faults import NO_FAULTS
from affordance.reporting import figures
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import Estimate, estimate_mean, estimate_proportion
from affordance.runs.random_streams import Stream
from affordance.runs.repeats import run_tasks
from affordance.settings import Settings
from affordance.vision.features import VisionError

# Number of simulated choices before any experience, with densities from the prior.
NUM_PRIOR_CHOICES = 10_000
# Number of density samples for the expected work of each option.
NUM_BAYES_SAMPLES = 2_000
# Number of density samples for the probability that an option is the cheapest; its standard error is at most 0.022.
NUM_PROBABILITY_SAMPLES = 500


class SimulatedTask(Protocol):
    """Simulation of a task with a gripped tool."""

    @property
    def work(self) -> float:
        """Absolute work of the joints, [J]."""

    @property
    def effort(self) -> float:
        """Integral of the squared torques, [N^2 m^2 s]."""


def remove_errors(settings: Settings) -> Settings:
    """Returns settings without errors of vision and without faults of arm or sensors."""
    return replace(settings, eye=None, vision_error=VisionError(), faults=NO_FAULTS)


@contextmanager
def blame(file: Path, key: str, failure: str) -> Iterator[None]:
    """Converts errors in a ``with`` block, except SeeingError and UnavailableError, to a BadValueError."""
    try:
        yield
    except (SeeingError, UnavailableError):
        raise
    except AffordanceError as error:
        raise BadValueError(file, key, f"{failure}: {error}") from error


def plan_grips(
    tools: Sequence[Tool], task: TaskCostModel, settings: Settings, *, seed: int, jobs: int, description: str
) -> dict[str, Choice]:
    """Plans a task for each grip of each tool, without faults, and returns the choices by tool.

    Each tool is observed once.

    Raises:
        AffordanceError: No motion can be planned with a grip.
        SeeingError: A tool is not detected in a picture.
    """
    settings = replace(settings, faults=NO_FAULTS)
    options = {tool.name: list_options(tool, seed=seed, eye=settings.eye) for tool in tools}
    tasks = [partial(_build_cost, task, option, settings) for each in options.values() for option in each]
    costs = iter(run_tasks(tasks, jobs=jobs, description=description))
    return {name: Choice(each, [next(costs) for _ in each], settings) for name, each in options.items()}


def _build_cost(task: TaskCostModel, option: Option, settings: Settings) -> OptionCost:
    return task.build_cost(ArmModel(load_arm(settings.arm)), option.gripped, settings)


def choose_by_sample(choice: Choice, memories: Sequence[MaterialMemory], seed: tuple[int, int]) -> Chosen:
    """Chooses a grip for each belief by the rule of the paper: the cheapest grip for one sample of densities."""
    parameters = []
    for trial, memory in enumerate(memories):
        rng = np.random.default_rng([*seed, trial, Stream.PAPER])
        parameters.append(choice.draw_parameters(memory, rng, 1))
    rng = np.random.default_rng([*seed, Stream.PAPER])
    return pick_cheapest(choice.compute_costs(np.concatenate(parameters, axis=1)), rng)


def compute_probabilities(choice: Choice, memories: Sequence[MaterialMemory], seed: tuple[int, int]) -> Array:
    """Computes the probability that each option has the least cost under each belief, (memories, options).

    ``choose_by_sample`` chooses options with these probabilities. The probability that no option is feasible is
    divided equally between all options.
    """
    found = []
    for trial, memory in enumerate(memories):
        rng = np.random.default_rng([*seed, trial, Stream.PROBABILITY])
        parameters = choice.draw_parameters(memory, rng, NUM_PROBABILITY_SAMPLES)
        picked = pick_cheapest(choice.compute_costs(parameters), rng)
        count = len(choice.options)
        shares = np.bincount(picked[picked != NO_OPTION], minlength=count) + (picked == NO_OPTION).sum() / count
        found.append(shares / len(picked))
    return np.array(found)


def choose_by_expectation(
    choice: Choice, memories: Sequence[MaterialMemory], seed: tuple[int, ...]
) -> tuple[Chosen, NDArray[np.bool_]]:
    """Chooses the grip with the least expected absolute work under each belief.

    Returns:
        Index of the chosen grip for each belief, and True if the expected integral of |tau|^2 prefers another grip.
    """
    chosen, flips = [], []
    for trial, memory in enumerate(memories):
        rng = np.random.default_rng([*seed, trial, Stream.BAYES])
        costs = choice.compute_costs(choice.draw_parameters(memory, rng, NUM_BAYES_SAMPLES))
        chosen.append(find_chosen(costs.cost, costs.feasible, Criterion.WORK))
        flips.append(find_chosen(costs.effort, costs.feasible, Criterion.EFFORT) != chosen[-1])
    return np.array(chosen), np.array(flips)


def choose_before_experience(choice: Choice, colours: tuple[Colour, ...], seed: int) -> Chosen:
    """Chooses grips by the rule of the paper for many samples from the prior, (NUM_PRIOR_CHOICES,)."""
    rng = np.random.default_rng([seed, Stream.PRIOR])
    memory = MaterialMemory().add_colours(colours, choice.settings.prior)
    return pick_cheapest(choice.compute_costs(choice.draw_parameters(memory, rng, NUM_PRIOR_CHOICES)), rng)


def find_cheaper_grip(simulated: Mapping[str, SimulatedTask]) -> str:
    """Finds the grip with the least absolute work. The task must be feasible with all grips."""
    return min(simulated, key=lambda grip: simulated[grip].work)


def check_one_grip_is_cheaper(file: Path, tool: Tool, works: Sequence[float]) -> None:
    """Checks that the grips of a tool differ in cost, so that one grip is correct.

    Raises:
        BadValueError: Both grips have the same cost.
    """
    cheapest, second = sorted(works)
    if second <= cheapest * (1.0 + TIE):
        problem = f"costs {cheapest:g} J in both grips, must have a cheaper one"
        raise BadValueError(file, f"tools: {tool.name}", problem)


def check_two_grips(file: Path, tools: Sequence[Tool]) -> None:
    """Checks that each tool has exactly two grips.

    Raises:
        BadValueError: A tool has another number of grips.
    """
    for tool in tools:
        if len(tool.grips) != 2:
            raise BadValueError(file, f"tools: {tool.name}.grips", f"has {len(tool.grips)} entries, must have 2")


def check_colours_known(file: Path, tools: Sequence[Tool], held: Sequence[Tool], held_file: Path) -> None:
    """Checks that all colours of the tools also occur in the held objects.

    Raises:
        BadValueError: A tool has a colour that the held objects do not have.
    """
    known = {part.looks_like.colour for tool in held for part in tool.components}
    for tool in tools:
        unknown = {part.looks_like.name for part in tool.components if part.looks_like.colour not in known}
        if unknown:
            problem = f"looks like {', '.join(sorted(unknown))}, must look like what {held_file.name} is made of"
            raise BadValueError(file, f"tools: {tool.name}", problem)


def find_grip_of_densest(tool: Tool, *, at_hand: bool) -> str:
    """Finds the grip with the densest material nearest to the hand, or farthest from it if not ``at_hand``."""

    def measure(held: Tool) -> float:
        densest = max(held.components, key=lambda part: part.material.density)
        return float(np.linalg.norm(densest.X_TE[:3, 3]))

    distances = {grip: measure(held) for grip, held in tool.list_gripped().items()}
    return (min if at_hand else max)(distances, key=distances.__getitem__)


def estimate_probability(right: Array, before: Chosen, correct: int) -> Estimate:
    """Estimates the probability of the correct choice over trials, with 95 % intervals, (K + 1,) each.

    The first value, before any experience, is the share of correct choices under the prior, with Wilson's interval.
    The other values are means over observers.

    Args:
        right: Probability of the correct option for each observer after 0 to K trials, (observers, K + 1).
        before: Choices under the prior, (N,).
        correct: Index of the correct option.
    """
    first = estimate_correct(before[:, None], correct)
    later = estimate_mean(right[:, 1:])
    clipped = (np.clip(each, 0.0, 1.0) for each in later)
    return Estimate(*(np.concatenate([one, other]) for one, other in zip(first, clipped, strict=True)))


def estimate_correct(chosen: Chosen, correct: int) -> Estimate:
    """Estimates the share of correct choices with Wilson's intervals, (K,) each.

    Args:
        chosen: Choices, (observers, K). If no option is usable, the choice counts as half correct, like a guess.
        correct: Index of the correct option.
    """
    hits: Array = ((chosen == correct) + 0.5 * (chosen == NO_OPTION)).sum(axis=0)
    return estimate_proportion(hits, len(chosen))


def measure_choices(
    data: Any,
    tools: Sequence[Tool],
    choices: Mapping[str, Choice],
    simulated: Mapping[str, Mapping[str, SimulatedTask]],
    off_axis: Mapping[str, float],
    *,
    colours: tuple[Colour, ...],
    seed: int,
) -> dict[str, Any]:
    """Computes shares of correct choices for each tool, for metrics.json.

    Results for the Bayes decision rule are computed for the first tool only.

    Args:
        data: Probabilities of grips, ``probability`` (observer, tool, moment, grip), indices of the chosen grips,
            ``paper`` (observer, tool, moment) and ``bayes`` (observer, moment), and ``flips`` (observer, moment).
        tools: Tools for which grips are chosen; the first is from the paper.
        choices: Choices by tool.
        simulated: Simulations of the task with the true densities, by tool and grip.
        off_axis: Largest relative change of the work if a part is displaced by 2 mm, by tool.
        colours: Colours of the held objects.
        seed: Seed of the run.
    """
    found: dict[str, dict[str, Any]] = {}
    for index, (name, choice) in enumerate(choices.items()):
        grips = [option.grip for option in choice.options]
        works = {grip: done.work for grip, done in simulated[name].items()}
        correct = find_cheaper_grip(simulated[name])
        before = choose_before_experience(choice, colours, seed)
        place = grips.index(correct)
        estimate = estimate_probability(data.probability.values[:, index, :, place], before, place)
        found[name] = {
            "p_correct": estimate.mean,
            "p_correct_ci95": estimate.ci95,
            "p_correct_drawn": estimate_correct(data.paper.values[:, index], place).mean,
            "correct_grip": correct,
            "energy_true": works,
            "chance": estimate.mean[0],
            "chance_by_symmetry": is_symmetric(tools[index]),
            "energy_ratio_true": max(works.values()) / min(works.values()),
            "off_axis_2mm_change": off_axis[name],
        }
    first, *others = found.values()
    grips = [option.grip for option in choices[tools[0].name].options]
    bayes = estimate_correct(data.bayes.values, grips.index(first["correct_grip"]))
    second = {
        f"{key}_headed_tool{end}": others[0][f"{key}{end}"]
        for key, end in (("p_correct", ""), ("p_correct", "_ci95"), ("correct_grip", ""), ("energy_true", ""))
        if others
    }
    return {
        "p_correct": first["p_correct"],
        "p_correct_ci95": first["p_correct_ci95"],
        "p_correct_drawn": first["p_correct_drawn"],
        "p_correct_bayes": bayes.mean,
        "p_correct_bayes_ci95": bayes.ci95,
        "effort_flips": data.flips.values.mean(axis=0),
        "correct_grip": first["correct_grip"],
        "energy_ratio_true": first["energy_ratio_true"],
        "tools": found,
        "off_axis_2mm_change": max(off_axis.values()),
        **second,
        "density_true": {part.material.name: part.material.density for part in tools[0].components},
    }


def draw_proportions(tools: Sequence[Tool], numbers: Mapping[str, Any], title: str, observers: int) -> Figure:
    """Plots the shares of correct choices (figures 8 and 10)."""
    estimates = {
        name: Estimate(each["p_correct"], *np.moveaxis(each["p_correct_ci95"], -1, 0))
        for name, each in numbers["tools"].items()
    }
    bayes = Estimate(numbers["p_correct_bayes"], *np.moveaxis(numbers["p_correct_bayes_ci95"], -1, 0))
    first, *others = estimates
    rules = {
        "the paper's rule, one density is drawn: probability": estimates[first],
        "work expected over the whole belief": bayes,
    }
    panels = {tools[0].name: rules}
    if others:
        panels["other tools"] = {name: estimates[name] for name in others}
    return figures.draw_choices(panels, title=f"{title}, {count_observers(observers)}, 95 % intervals")


def caption_proportions(tools: Sequence[Tool], numbers: Mapping[str, Any]) -> str:
    """Returns the caption of figures 8 and 10 without the figure number."""
    first, *others = (tool.name.replace("_", " ") for tool in tools)
    chance = "Chance depends on the shapes."
    if numbers["tools"][tools[0].name]["chance_by_symmetry"]:
        chance = f"Both ends of the {first} look alike, so chance is one half by symmetry"
        chance += "; for the others it depends on their shapes." if others else "."
    return (
        "Probability of the correct choice after trials with the objects of Simulation II, mean over observers."
        f" {chance} For the {first}, two rules are shown. The paper's rule compares the work at one density of each"
        " material, drawn from the belief; the other compares the work expected over the whole belief."
    )


def tabulate_tools(numbers: Mapping[str, Any]) -> pd.DataFrame:
    """Tabulates the work with each grip, the correct grip, and shares of correct choices for each tool."""
    rows = {}
    for name, each in numbers["tools"].items():
        p = each["p_correct"]
        rows[name] = {
            "absolute work by grip": " and ".join(
                f"{work:.2f} J ({grip})" for grip, work in each["energy_true"].items()
            ),
            "correct grip": each["correct_grip"],
            "change of absolute work if a part is displaced by 2 mm": f"{each['off_axis_2mm_change']:.1%}",
            "correct before": f"{p[0]:.0%}{' (by symmetry)' if each['chance_by_symmetry'] else ''}",
            "after one trial": f"{p[1]:.1%}",
            "after two": f"{p[2]:.1%}",
            "after the last": f"{p[-1]:.1%}",
        }
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("tool")


def tabulate_rules(numbers: Mapping[str, Any]) -> pd.DataFrame:
    """Tabulates shares of correct choices for the first tool by two rules and two cost measures."""
    rows = {
        "one density drawn from the belief (the paper's): probability": numbers["p_correct"],
        "the same rule: share of one draw for each observer": numbers["p_correct_drawn"],
        "least expected absolute work, averaged over the whole belief": numbers["p_correct_bayes"],
        "cases in which the least expected integral of torque squared would choose otherwise": numbers[
            "effort_flips"
        ],
    }
    shares = {rule: [", ".join(f"{share:.0%}" for share in each)] for rule, each in rows.items()}
    return pd.DataFrame.from_dict(shares, orient="index", columns=["correct choices"]).rename_axis("rule")


def compare_measures(numbers: Mapping[str, Any], tool: Tool) -> str:
    """Describes if the integral of squared torques and the absolute work prefer the same grip of a tool."""
    efforts = numbers["effort_true"]
    agrees = "agrees" if min(efforts, key=efforts.__getitem__) == numbers["correct_grip"] else "does not agree"
    shown = " and ".join(f"{effort:.0f} N²m²s ({grip})" for grip, effort in efforts.items())
    return (
        f"The integral of torque squared, another measure of effort, {agrees} with the absolute work on the correct"
        f" grip of the {tool.name.replace('_', ' ')}: {shown}."
    )
