"""Prices of options: motions planned once in a process, and their costs by a criterion under given inertias."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.demand import Criterion, Demand
from affordance.choice.inner_simulation import Choice, TaskCostModel
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.choice.planned import Work, plan_once
from affordance.plant.load import load_arm
from affordance.settings import Settings

# Lever by which a moment at the grip counts as a force: a round pad of radius r whose friction holds a force F holds
# a moment 2/3 r F (even pressure; Howe & Cutkosky 1996, Int. J. Robotics Research 15:557), r = 0.03 m, [m].
GRIP_LEVER = 0.02


@dataclass(frozen=True)
class GripBounds:
    """Largest wrench that the gripper holds.

    Attributes:
        force: Largest force, [N].
        moment: Largest moment about the grip, [N m].
    """

    force: float = np.inf
    moment: float = np.inf

    @property
    def lever(self) -> float:
        """Lever by which a moment counts as a force, [m]: that of the bounds if both are given."""
        both = np.isfinite(self.force) and np.isfinite(self.moment)
        return self.moment / self.force if both else GRIP_LEVER

    def admit(self, force: Array, moment: Array) -> NDArray[np.bool_]:
        """Returns where a force, [N], and a moment, [N m], are within the bounds; arrays of one shape."""
        return (force <= self.force) & (moment <= self.moment)


def plan_options(options: Sequence[Option], task: TaskCostModel, settings: Settings) -> Choice:
    """Plans a task with every option, once in a process; options with which nothing can be planned cost infinitely.

    Raises:
        AffordanceError: There is no option, or two have the same name.
        ModelFileError: The arm cannot be loaded.
    """
    arm = load_arm(settings.arm)
    return Choice(options, [plan_once(Work.of(task, option.gripped), settings, arm) for option in options], settings)


def measure(
    choice: Choice, pi: Array, criterion: Criterion, bounds: GripBounds = GripBounds()
) -> tuple[Costs, Demand]:
    """Computes the costs by a criterion, and the demands, of all options for parameters, (options, S, 10)."""
    costs, demand = choice.compute_costs(pi), choice.compute_demands(pi)
    feasible = costs.feasible & bounds.admit(demand.force, demand.moment)
    if criterion is Criterion.MARGIN:
        cost = demand.loads.max(axis=1)
    elif criterion is Criterion.GRIP:
        cost = np.hypot(demand.force, demand.moment / bounds.lever)
    else:
        cost = costs.effort if criterion is Criterion.EFFORT else costs.cost
    return costs._replace(feasible=feasible, cost=cost), demand


def price_options(choice: Choice, pi: Array, criterion: Criterion) -> Costs:
    """Computes the costs by a criterion as ``measure`` does, for a gripper that holds everything.

    Demands, which take more than half of the time, are computed only for criteria that are about them.
    """
    if criterion not in (Criterion.WORK, Criterion.EFFORT):
        return measure(choice, pi, criterion)[0]
    costs = choice.compute_costs(pi)
    return costs._replace(cost=costs.effort if criterion is Criterion.EFFORT else costs.cost)
