"""Suggestion of a lighter tool or an easier task if no tool can do a task."""

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hammer import Hammer
from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.picking import MIN_FEASIBILITY
from affordance.choice.pricing import GripBounds, plan_once
from affordance.choice.ranking import Ranking
from affordance.choice.reach import PathTask
from affordance.exceptions import name_gripped
from affordance.plant.load import load_arm
from affordance.settings import Settings

# Number of samples of the belief, and number of bisection steps for the weight of a feasible tool.
_NUM_SAMPLES, _HALVINGS = 1000, 7


def explain_failure(
    ranking: Ranking,
    task: TaskCostModel,
    memory: MaterialMemory,
    settings: Settings,
    bounds: GripBounds,
    rng: np.random.Generator,
) -> str:
    """Explains why no option of a ranking is usable, and suggests a lighter tool or an easier task.

    If both remain infeasible, the text describes the easiest task that was tried.
    """
    nearest = ranking.ranked[0]
    said = f"no tool can do the task; nearest is {name_gripped(nearest.option.name)}: {nearest.infeasible_reason}"
    arm, parts = load_arm(settings.arm), nearest.option.gripped
    plan = plan_once(task, parts, settings, arm)
    (pi,) = Choice([nearest.option], [plan], settings).draw_parameters(memory, rng, _NUM_SAMPLES)
    share, ways, words = _find_share(plan, pi, bounds), list[str](), ""
    if share > 0.0:
        ways.append(f"with a tool of {share:.2f} times the weight")
    for easier, words in task.list_easier() if isinstance(task, Hammer | PathTask) else ():
        if _can_do(plan_once(easier, parts, settings, arm), pi, bounds):
            ways.append(words)
            break
    if ways:
        return f"{said}; the task would be feasible {' or '.join(ways)}"
    return f"{said}; the task would not be feasible even {words}, the easiest variant tried" if words else said


def _can_do(plan: OptionCost, pi: Array, bounds: GripBounds) -> bool:
    if plan.infeasible_reason:
        return False
    demand = plan.compute_demand(pi)
    feasible = plan.compute(pi).feasible & bounds.admit(demand.force, demand.moment)
    return float(feasible.mean()) >= MIN_FEASIBILITY


def _find_share(plan: OptionCost, pi: Array, bounds: GripBounds) -> float:
    """Finds the largest factor in [0, 1) for scaling a tool's inertia so that the task becomes feasible.

    Returns 0 if the task is infeasible even for the smallest factor tried.
    """
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _can_do(plan, middle * pi, bounds) else (low, middle)
    return low
