"""Numbers of the study of active choice: right choices after each number of holds, for each rule."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from affordance.belief.material_memory import MaterialMemory
from affordance.belief.material_memory import start_memory as start_learner
from affordance.reporting.statistics import estimate_proportion
from studies.active import world as worlds
from studies.active.rules import RULES

# Largest number of holds after which choices are judged, in the workshop (all objects) and in the paper's world.
HORIZON, PAPER_HORIZON = 9, 4
# Required share of right choices, and cost of an infeasible choice relative to the most expensive feasible one.
_RIGHT, _FAILED = 0.95, 2.0
_NUM_JUDGED = 1000
# Number of timed calls; the first, which fills caches, is discarded.
_NUM_TIMED = 10
_NUM_SAMPLES = 4000


@dataclass(frozen=True)
class ActiveConfig:
    """Configuration of the observers of one rule."""

    rule: str  # name of the rule
    seed: int = 0  # root of every random draw; worlds and errors are the same for all rules
    tasks: tuple[str, ...] = worlds.TASKS  # names of the tasks of the workshop; none for the paper's world
    horizon: int = HORIZON  # largest number of holds
    is_simulated: bool = False  # true if holds are simulated in the Diagram, false if computed in closed form

    def build(self) -> worlds.Workshop:
        """Builds the world."""
        return worlds.build_workshop(self.tasks) if self.tasks else worlds.build_paper_world()


def run_observer(config: ActiveConfig, repeat: int) -> dict[str, NDArray[Any]]:
    """Lets an observer hold one object after the other.

    Returns:
        ``right``, (holds + 1, tasks); ``regret``, the excess over the least cost, (holds + 1, tasks), [J]; ``held``,
        the indices of the objects held, (holds,).
    """
    workshop = config.build()
    true = worlds.draw_world(workshop, np.random.default_rng([config.seed, repeat, 1]))
    memory = worlds.start_memory(workshop, start_learner())
    left, names = list(workshop.candidates), list(workshop.candidates)
    right, regret, held = [], [], []
    for number in range(config.horizon + 1):
        judged = _judge(workshop, true, memory, np.random.default_rng([config.seed, repeat, 2, number]))
        right.append(judged[0])
        regret.append(judged[1])
        if number < config.horizon:
            rng = np.random.default_rng([config.seed, repeat, 3, number])
            name = RULES[config.rule](workshop, memory, left, rng)
            left.remove(name)
            held.append(names.index(name))
            seed = (config.seed, repeat, 4 + names.index(name))
            memory = worlds.hold(workshop, true, name, memory, seed, is_simulated=config.is_simulated)
    return {"right": np.array(right), "regret": np.array(regret), "held": np.array(held)}


def _judge(
    workshop: worlds.Workshop, true: worlds.TrueWorld, memory: MaterialMemory, rng: np.random.Generator
) -> tuple[list[float], list[float]]:
    _, decisions = worlds.decide(workshop, memory, _NUM_JUDGED, rng)
    right, regret = [], []
    for decision in decisions:
        costs = true.costs[decision.name]
        finite = costs[np.isfinite(costs)]
        chosen = float(np.where(np.isfinite(costs), costs, _FAILED * finite.max())[decision.find_best()])
        right.append(float(chosen <= finite.min()))
        regret.append(chosen - float(finite.min()))
    return right, regret


def count_holds(right: NDArray[Any]) -> int:
    """Counts the holds after which at least .95 of choices stay right; the horizon plus one if they never do."""
    shares = right.mean(axis=(0, 2))
    reached = shares >= _RIGHT
    stays = np.flatnonzero(~reached)
    return 0 if not len(stays) else int(stays[-1]) + 1


def describe_rules(found: Mapping[str, Mapping[str, NDArray[Any]]]) -> dict[str, Any]:
    """Summarises the results in the workshop for each rule, as in metrics.json."""
    rules = _describe(found)
    holds = {name: count_holds(arrays["right"]) for name, arrays in found.items()}
    others = [number for name, number in holds.items() if name != "value"]
    third = min(3, len(rules["value"]["regret_J"]) - 1)
    return {
        "workshop": {"holds_to_95": holds, "regret_after_3": rules["value"]["regret_J"][third], "rules": rules},
        "value_holds": holds["value"],
        "value_less_best_other": holds["value"] - min(others),
        "regret_after_3": rules["value"]["regret_J"][third],
        **{f"value_over_{name}": holds["value"] / max(holds[name], 1) for name in ("random", "information")},
    }


def describe_paper_world(found: Mapping[str, Mapping[str, NDArray[Any]]], names: Sequence[str]) -> dict[str, Any]:
    """Summarises the results in the paper's world for each rule, as in metrics.json; ``names`` are decisions."""
    right = found["value"]["right"]
    each = {name: count_holds(right[..., [place]]) for place, name in enumerate(names)}
    holds = {name: count_holds(arrays["right"]) for name, arrays in found.items()}
    return {
        "paper_world": {"holds_to_95": holds, "holds_to_95_each": each, "rules": _describe(found)},
        "paper_holds": holds["value"],
        "paper_holds_most": max(each.values()),
    }


def _describe(found: Mapping[str, Mapping[str, NDArray[Any]]]) -> dict[str, Any]:
    """Summarises shares of right choices and regrets of each rule after each number of holds."""
    rules = {}
    for name, arrays in found.items():
        right = arrays["right"]
        share = estimate_proportion(right.sum(axis=(0, 2)), right.shape[0] * right.shape[2])
        rules[name] = {
            "right": share.mean.tolist(),
            "right_ci95": share.ci95.tolist(),
            "regret_J": arrays["regret"].sum(axis=2).mean(axis=0).tolist(),
        }
    return rules


def time_advice(tasks: tuple[str, ...] = worlds.TASKS) -> float:
    """Measures the CPU time of advice per candidate as the median of several calls, [ms]."""
    workshop = worlds.build_workshop(tasks)
    names = list(workshop.candidates)
    memory = worlds.start_memory(workshop, start_learner())
    taken = [[_time(workshop, memory, names[:number]) for number in (len(names), 1)] for _ in range(_NUM_TIMED)]
    return 1e3 * float(np.median(np.diff(taken[1:]))) / (1 - len(names))


def _time(workshop: worlds.Workshop, memory: MaterialMemory, names: Sequence[str]) -> float:
    begin = process_time()
    worlds.advise(workshop, memory, names, num_samples=_NUM_SAMPLES)
    return process_time() - begin
