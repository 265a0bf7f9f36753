"""Compares the worth of a hold by regression with nested brute force, where the learner updates on each outcome."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.next_hold import Question
from affordance.choice.pricing import plan_options
from affordance.objects.colour import Colour
from affordance.objects.materials import load_materials
from affordance.robots.robot import Robot
from affordance.vision.eye import measure_drawing
from affordance.vision.systems import predict_object
from studies.active import world as worlds

# Number of outcomes; number of draws from the belief after each outcome for hammering, and its factor for other
# tasks, which have near ties and therefore need more draws, but whose costs are computed ten times faster; number of
# draws from the belief before the hold; number of samples of the regression.
OUTCOMES, DRAWS, _OTHERS, _BEFORE, _SAMPLES = 300, 400, 5, 10_000, 4000
# Number of regressions with other samples; the SD of their results is the error of one regression. Samples are spread
# evenly, so the deviation within one regression would overstate its error.
_SEEDS = 16
# Number of draws after each outcome: one half picks an option and the other half prices it.
_HALVES = 2
# Number of draws of an object's density in each part of the belief; one of them is an outcome.
_PER_PART = 20
# Relative error and number of standard errors within which both worths count as equal, and largest worth that counts
# as none, [J].
_SHARE, _Z, _LEAST = 0.15, 2.0, 1e-12


class Case(NamedTuple):
    """Belief, decision, and the object that may be held next."""

    held: tuple[str, ...]  # names of the objects held before
    task: str  # name of the task
    tools: tuple[str, ...]  # names of the tools to choose from; empty for all tools of the task
    candidate: str  # name of the object that may be held next


_OAK, _CAST, _RUBBER, _BRASS = "bar of oak", "rod of cast steel", "block of rubber", "pin of brass"
_STAINLESS = "sheet of stainless steel"
_CLAW, _MACHINIST, _MALLET = ("claw hammer",), ("machinist hammer",), ("mallet",)
CASES = (
    Case((), "hammer", (), _OAK),
    Case((), "hammer", _CLAW, _OAK),
    Case((), "hammer", _CLAW, _CAST),
    Case((), "hammer", _CLAW, _BRASS),
    Case((), "hammer", _MACHINIST, _OAK),
    Case((), "hammer", _MACHINIST, _CAST),
    Case((), "hammer", _MALLET, _OAK),
    Case((), "hammer", _MALLET, _RUBBER),
    Case((_OAK,), "hammer", _MALLET, _RUBBER),
    Case((_CAST,), "hammer", _CLAW, _OAK),
    Case((_OAK,), "hammer", _MACHINIST, _CAST),
    Case((), "reach", (), _OAK),
    Case((), "reach", (), _CAST),
    Case((), "reach", (), _RUBBER),
    Case((), "reach", (), _BRASS),
    Case((), "reach", _CLAW, _OAK),
    Case((), "reach", _MALLET, _OAK),
    Case((), "reach", _MALLET, _RUBBER),
    Case((_CAST,), "reach", (), _OAK),
    Case((_OAK,), "reach", _MALLET, _RUBBER),
    Case((), "mash", (), _BRASS),
    Case((), "mash", (), _STAINLESS),
    Case((), "mash", (), _OAK),
    Case((_BRASS,), "mash", (), _STAINLESS),
)


@dataclass(frozen=True)
class WorthConfig:
    """Configuration of the comparison."""

    outcomes: int = OUTCOMES  # number of outcomes
    draws: int = DRAWS  # number of draws after each outcome for hammering; five times as many for other tasks


def describe_worths(found: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Summarises comparisons: share within 15 % or two standard errors, and largest worth of irrelevant objects."""
    error = np.abs(found["regression"] - found["brute_force"])
    share = error / np.maximum(found["brute_force"], _LEAST)
    z = error / np.maximum(np.hypot(found["regression_se"], found["brute_force_se"]), _LEAST)
    relevant = found["relevant"] > 0.0
    near = (share <= _SHARE) | (z <= _Z)
    worths = [
        {
            **case._asdict(),
            **{name: float(values[place]) for name, values in found.items()},
            "error": float(share[place]),
            "z": float(z[place]),
            "within": bool(near[place]),
        }
        for place, case in enumerate(CASES[: len(error)])
    ]
    return {
        "worth_error": {
            "cases": len(error),
            "relevant": int(relevant.sum()),
            "within": int(near[relevant].sum()),
            "worths": worths,
        },
        "worth_cases": len(error),
        "worths_within": float(near[relevant].mean()),
        "irrelevant_J": float(found["regression"][~relevant].max(initial=0.0)),
    }


def price_by_brute_force(
    workshop: worlds.Workshop, memory: MaterialMemory, name: str, outcomes: int, draws: int, seed: int
) -> tuple[float, float]:
    """Computes the worth of a hold by brute force.

    Outcomes are drawn, the learner updates on each, and all options are priced again. The belief about the object's
    density is split into as many equally probable parts as there are outcomes, and one true density is drawn from
    each part, because a few outcomes in the tail may account for most of a worth. Half of the draws after an outcome
    pick the option and the other half price it; then the halves change roles, so that noise does not count as worth.
    Infeasible draws cost the same as before the hold.

    Returns:
        Worth for the workshop's only question, and its standard error, from differences between neighbours, [J].
    """
    rng = np.random.default_rng([seed, 0])
    _, (before,) = worlds.decide(workshop, memory, _BEFORE, rng)
    failure, now = before.price_failure(), before.find_best()
    falls = []
    for number, densities in enumerate(_draw_outcomes(workshop, memory, name, outcomes, rng)):
        after, _ = worlds.learn(workshop, name, densities, memory, (seed, 1, number))
        _, (decision,) = worlds.decide(workshop, after, draws, rng)
        first, second = (half.mean(axis=1) for half in np.array_split(decision.charge(failure), _HALVES, axis=1))
        falls.append(np.mean([_fall(first, second, now), _fall(second, first, now)]))
    se = np.sqrt(np.mean(np.diff(falls) ** 2) / (2.0 * outcomes))
    return float(np.mean(falls)), float(se)


def _draw_outcomes(
    workshop: worlds.Workshop, memory: MaterialMemory, name: str, outcomes: int, rng: np.random.Generator
) -> list[dict[Colour, float]]:
    """Draws densities of an object of one material in increasing order, one from each part of the belief."""
    parts = measure_drawing(workshop.candidates[name])
    (colour,) = {part.colour for part in parts}
    column = memory.recall([part.appearance for part in parts], workshop.settings.prior).columns[0]
    belief = predict_object(parts, memory, workshop.settings.prior)
    drawn = np.sort(belief.densities.draw_samples(rng, _PER_PART * outcomes)[:, column]).reshape(outcomes, _PER_PART)
    return [{colour: float(row[rng.integers(_PER_PART)])} for row in drawn]


def _fall(picking: Array, pricing: Array, now: int) -> float:
    return float(pricing[now] - pricing[picking.argmin()])


def compare_worth(config: WorthConfig, number: int) -> dict[str, NDArray[Any]]:
    """Computes both worths for the case with a given number.

    Returns:
        ``relevant``, 1 if a tool contains the candidate's material; ``feasible``, the fraction of samples in which
        the option that fails most often is feasible; and both worths with their standard errors, [J].
    """
    case = CASES[number]
    whole = worlds.build_workshop((case.task,))
    (question,) = whole.questions
    options = [each for each in question.choice.options if not case.tools or each.object_name in case.tools]
    choice = plan_options(options, Robot().load_task(case.task), whole.settings)
    workshop = whole._replace(questions=[Question(case.task, choice)])
    means = {each.colour: each.density for each in load_materials().values()}
    chosen = {name: whole.candidates[name] for name in (*case.held, case.candidate)}
    memory = worlds.start_memory(workshop._replace(candidates=chosen), MaterialMemory())
    for name in case.held:
        memory, _ = worlds.learn(workshop, name, means, memory, (number, 2))
    worths = [
        worlds.advise(workshop, memory, [case.candidate], num_samples=_SAMPLES, seed=seed).ranked[0].worth
        for seed in (number, *range(len(CASES), len(CASES) + _SEEDS))
    ]
    draws = config.draws if case.task == "hammer" else _OTHERS * config.draws
    worth, se = price_by_brute_force(workshop, memory, case.candidate, config.outcomes, draws, number)
    _, (decision,) = worlds.decide(workshop, memory, _BEFORE, np.random.default_rng([number, 3]))
    shown = {part.looks_like.colour for part in whole.candidates[case.candidate].components}
    found = {
        "relevant": float(any(part.colour in shown for option in options for part in option.features)),
        "feasible": float(decision.feasible.mean(axis=1).min()),
        "regression": worths[0],
        "regression_se": float(np.std(worths[1:], ddof=1)),
        "brute_force": worth,
        "brute_force_se": se,
    }
    return {name: np.array(value) for name, value in found.items()}
