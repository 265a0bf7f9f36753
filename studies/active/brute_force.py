"""Worth of a hold by regression against nested brute force, in which the learner learns from each outcome."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.choice.demand import Criterion
from affordance.choice.next_hold import Question, advise_hold
from affordance.choice.weighing import plan_options
from affordance.objects.materials import load_materials
from affordance.robots.robot import Robot
from studies.active import world as worlds

# Outcomes, draws of the belief after each, and of the belief before.
OUTCOMES, DRAWS, _BEFORE = 300, 400, 10_000
# Draws after each outcome of which a half picks an option and the other half prices it.
_HALVES = 2


class Case(NamedTuple):
    """Belief, decision and object to hold.

    Attributes:
        held: Names of what was held before.
        task: Name of the task.
        tools: Names of the tools to choose from; all of the task if empty.
        candidate: Name of the object.
    """

    held: tuple[str, ...]
    task: str
    tools: tuple[str, ...]
    candidate: str


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


def compare_worths(
    cases: Sequence[Case] = CASES, outcomes: int = OUTCOMES, draws: int = DRAWS
) -> list[dict[str, Any]]:
    """Compares both worths in each case, [J], with standard errors.

    Returns: For each case its parts, ``relevant`` (a tool is of the candidate's material), the share of the samples
        with which the option that is taken now is ``feasible``, both worths, and the distance of the regression:
        ``error`` over brute force, and ``z`` over the standard error of the difference.
    """
    return [_compare(case, outcomes, draws, number) for number, case in enumerate(cases)]


def summarise_errors(compared: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Summarises comparisons: the share within 15 % or two standard errors, and the worst that is irrelevant."""
    near = [bool(each["error"] <= 0.15 or abs(each["z"]) <= 2.0) for each in compared if each["relevant"]]
    return {
        "worth_error": {
            "cases": len(compared),
            "relevant": len(near),
            "within": sum(near),
            "worths": list(compared),
        },
        "worths_within": sum(near) / len(near),
        "irrelevant_J": max((each["regression"] for each in compared if not each["relevant"]), default=0.0),
    }


def price_by_brute_force(
    workshop: worlds.Workshop, memory: Memory, name: str, outcomes: int, draws: int, seed: int
) -> tuple[float, float]:
    """Prices a hold by brute force: outcomes are drawn, the learner learns, and all options are priced anew.

    Half of the draws after an outcome pick the option and the others price it, each by turns, so that noise does not
    count as worth. Infeasible draws are charged as they are before the hold.

    Returns: Worth for the workshop's one question and its standard error, [J].
    """
    rng = np.random.default_rng([seed, 0])
    _, (before,) = worlds.decide(workshop, memory, _BEFORE, rng)
    failure, now = before.price_failure(), before.find_best()[0]
    falls = []
    for number in range(outcomes):
        after, _ = worlds.learn(workshop, name, None, memory, (seed, 1, number))
        _, (decision,) = worlds.decide(workshop, after, draws, rng)
        first, second = (half.mean(axis=1) for half in np.array_split(decision.charge(failure), _HALVES, axis=1))
        falls.append(np.mean([_fall(first, second, now), _fall(second, first, now)]))
    return float(np.mean(falls)), float(np.std(falls) / np.sqrt(outcomes))


def _fall(picking: Array, pricing: Array, now: int) -> float:
    return float(pricing[now] - pricing[picking.argmin()])


def _compare(case: Case, outcomes: int, draws: int, seed: int) -> dict[str, Any]:
    whole = worlds.build_workshop()
    question = next(each for each in whole.questions if each.name == case.task)
    options = [each for each in question.choice.options if not case.tools or each.object_name in case.tools]
    choice = plan_options(options, Robot().load_task(case.task), whole.settings)
    workshop = whole._replace(questions=[Question(case.task, choice)])
    means = {each.colour: each.density for each in load_materials().values()}
    chosen = {name: whole.candidates[name] for name in (*case.held, case.candidate)}
    memory = worlds.start_memory(workshop._replace(candidates=chosen), MaterialMemory())
    for name in case.held:
        memory, _ = worlds.learn(workshop, name, means, memory, (seed, 2))
    advice = advise_hold(
        [whole.candidates[case.candidate]],
        workshop.questions,
        memory,
        whole.settings,
        criterion=Criterion.WORK,
        seed=seed,
    ).ranked[0]
    worth, se = price_by_brute_force(workshop, memory, case.candidate, outcomes, draws, seed)
    _, (decision,) = worlds.decide(workshop, memory, _BEFORE, np.random.default_rng([seed, 3]))
    shown = {part.looks_like.colour for part in whole.candidates[case.candidate].components}
    return {
        **case._asdict(),
        "relevant": any(part.colour in shown for option in options for part in option.features),
        "feasible": float(decision.feasible.mean(axis=1).min()),
        "regression": advice.worth,
        "regression_se": advice.worth_se,
        "brute_force": worth,
        "brute_force_se": se,
        "error": abs(advice.worth - worth) / max(worth, 1e-12),
        "z": (advice.worth - worth) / max(float(np.hypot(se, advice.worth_se)), 1e-12),
    }
