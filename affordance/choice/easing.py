"""Suggests what would be feasible if a task is not: a lighter tool, or an easier task."""

from collections.abc import Callable, Iterator
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.options import Option
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.choice.pricing import GripBounds, plan_once
from affordance.choice.ranking import Ranking
from affordance.exceptions import name_gripped
from affordance.plant.load import load_arm
from affordance.settings import Settings

# Number of samples of the belief, and of bisection steps for the fraction of a tool's weight.
_NUM_SAMPLES, _HALVINGS = 1000, 7

# Function that returns True where force, [N], and moment, [N m], at the grip are allowed.
type Admit = Callable[[Array, Array], NDArray[np.bool_]]


@runtime_checkable
class Easable(Protocol):
    """Task that can be made easier."""

    def list_easier(self) -> Iterator[tuple[TaskCostModel, str]]:
        """Lists easier tasks, each with a description of the difference."""


def explain_failure(
    ranking: Ranking,
    task: TaskCostModel,
    memory: MaterialMemory,
    settings: Settings,
    bounds: GripBounds,
    rng: np.random.Generator,
) -> str:
    """Explains why no option of a ranking is usable: what the nearest one lacks, and what it could do instead."""
    nearest = ranking.ranked[0]
    easier = find_easier(nearest.option, task, memory, settings, bounds.admit, rng)
    reason = "; ".join([nearest.infeasible_reason, *([easier] if easier else [])])
    return f"no tool can do the task; nearest is {name_gripped(nearest.option.name)}: {reason}"


def find_easier(
    option: Option,
    task: TaskCostModel,
    memory: MaterialMemory,
    settings: Settings,
    admit: Admit,
    rng: np.random.Generator,
) -> str:
    """Describes what would be feasible with an option: a lighter tool, or the first easier task that works.

    If neither would, the description names the easiest task that was tried; it is empty if there is none.
    """
    arm, parts = load_arm(settings.arm), option.gripped
    plan = plan_once(task, parts, settings, arm)
    (pi,) = Choice([option], [plan], settings).draw_parameters(memory, rng, _NUM_SAMPLES)
    ways = []
    share = 0.0 if plan.infeasible_reason else _find_share(plan, pi, admit)
    if share > 0.0:
        ways.append(f"with a tool of {share:.2f} times the weight")
    words = ""
    for easier, words in task.list_easier() if isinstance(task, Easable) else ():
        if _can_do(plan_once(easier, parts, settings, arm), pi, admit):
            ways.append(words)
            break
    if ways:
        return f"the task would be feasible {' or '.join(ways)}"
    return f"the task would not be feasible even {words}, the easiest variant tried" if words else ""


def _can_do(plan: OptionCost, pi: Array, admit: Admit) -> bool:
    if plan.infeasible_reason:
        return False
    demand = plan.compute_demand(pi)
    feasible = plan.compute(pi).feasible & admit(demand.force, demand.moment)
    return float(feasible.mean()) >= MIN_FEASIBILITY


def _find_share(plan: OptionCost, pi: Array, admit: Admit) -> float:
    """Finds the largest fraction of a tool's inertia with which it could do the task; 0 if there is none."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _can_do(plan, middle * pi, admit) else (low, middle)
    return low
