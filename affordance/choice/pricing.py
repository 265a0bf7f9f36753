"""Computes costs of options by a criterion, with a cache of planned motions."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.demand import Criterion, Demand
from affordance.choice.inner_simulation import Choice, OptionCost, TaskCostModel
from affordance.choice.motion_cost import Costs
from affordance.choice.options import Option
from affordance.exceptions import AffordanceError
from affordance.objects.tool import PosedShape
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings

# Lever that converts a moment at the grip to a force, [m]. If friction on a round pad of radius r withstands a force
# F, it withstands a moment of 2/3 r F (uniform pressure; Howe & Cutkosky 1996, Int. J. Robotics Research 15:557); r =
# 0.03 m.
GRIP_LEVER = 0.02
# Largest number of planned motions in the cache. A motion takes 0.1 MB, a blow 2 MB.
_MOST_PLANS = 128
# Quantiles at the ends of the 90 % interval; peak loads are compared by the upper quantile.
_LEVELS = (0.05, 0.95)


@dataclass(frozen=True)
class GripBounds:
    """Largest wrench that the gripper can hold.

    Attributes:
        force: Largest force, [N].
        moment: Largest moment about the grip, [N m].
    """

    force: float = np.inf
    moment: float = np.inf

    @property
    def lever(self) -> float:
        """Lever that converts a moment to a force, [m]: the ratio of both bounds, or a default value."""
        both = np.isfinite(self.force) and np.isfinite(self.moment)
        return self.moment / self.force if both else GRIP_LEVER

    def admit(self, force: Array, moment: Array) -> NDArray[np.bool_]:
        """Returns a mask that is True where force, [N], and moment, [N m], are within the bounds."""
        return (force <= self.force) & (moment <= self.moment)


class Amount(NamedTuple):
    """Mean and 90 % interval of a quantity under the belief."""

    mean: float
    p05: float
    p95: float

    @classmethod
    def of(cls, samples: Array) -> "Amount":
        """Computes mean and interval of samples, (S,). All are infinite if any sample is not finite."""
        if not np.isfinite(samples).all():
            return cls(np.inf, np.inf, np.inf)
        low, high = np.quantile(samples, _LEVELS)
        return cls(float(samples.mean()), float(low), float(high))


_UNKNOWN = Amount(np.nan, np.nan, np.nan)


class Amounts(NamedTuple):
    """Costs and peak loads of an option under the belief. Loads are NaN if they were not computed."""

    work: Amount  # absolute work of the joints, [J]
    effort: Amount  # integral of |tau|^2 dt, [N^2 m^2 s]
    cost: Amount  # cost by the criterion, in its unit
    margin: Amount = _UNKNOWN  # highest fraction of a joint's torque limit, [1]
    force: Amount = _UNKNOWN  # peak force at the grip, [N]
    moment: Amount = _UNKNOWN  # peak moment about the grip, [N m]
    joint: str = ""  # name of the joint with the highest fraction of its torque limit

    @classmethod
    def of(cls, costs: Costs, demand: Demand | None, joint_names: Sequence[str]) -> "Amounts":
        """Computes the amounts from samples of one option.

        Args:
            costs: Costs for S samples.
            demand: Peak loads for these samples; None if they were not computed.
            joint_names: Names of the joints.
        """
        work, effort, cost = (Amount.of(each) for each in (costs.work, costs.effort, costs.cost))
        if demand is None:
            return cls(work, effort, cost)
        loads = demand.loads
        worst = int(np.argmax(np.quantile(loads, _LEVELS[1], axis=1))) if np.isfinite(loads).all() else 0
        margin, force, moment = (Amount.of(each) for each in (loads.max(axis=0), demand.force, demand.moment))
        return cls(work, effort, cost, margin, force, moment, joint_names[worst])

    def name_excess(self, bounds: GripBounds) -> str:
        """Describes the limit that the 95 % quantiles of the loads exceed by the largest factor."""
        margin, force, moment = self.margin.p95, self.force.p95, self.moment.p95
        excess = {
            f"{self.joint} must bear {margin:.3g} times its torque limit": margin,
            f"the grip must hold {force:.3g} N, --max-grip-force allows {bounds.force:g} N": force / bounds.force,
            f"the grip must hold {moment:.3g} N m, --max-grip-moment allows {bounds.moment:g} N m": (
                moment / bounds.moment
            ),
        }
        worst = max(excess, key=lambda each: excess[each])
        return worst if excess[worst] > 1.0 else "the motion must be faster than the joints' velocity limits allow"


def explain_excess(plan: OptionCost, pi: Array, bounds: GripBounds, joint_names: Sequence[str]) -> str:
    """Explains why an option is infeasible for parameters pi, (S, 10): its motion fails, or a limit is exceeded."""
    if plan.infeasible_reason:
        return plan.infeasible_reason
    return Amounts.of(plan.compute(pi), plan.compute_demand(pi), joint_names).name_excess(bounds)


def price_options(
    choice: Choice, pi: Array, criterion: Criterion = Criterion.WORK, bounds: GripBounds | None = None
) -> tuple[Costs, Demand | None]:
    """Computes costs by a criterion, and peak loads, of all options.

    Peak loads take more than half of the time. They are computed only if there are bounds or the criterion uses
    loads.

    Args:
        choice: Options with planned motions.
        pi: Inertial parameters, (options, S, 10).
        criterion: Criterion.
        bounds: Largest wrench that the gripper can hold; None for no bound.

    Returns:
        Costs, and peak loads or None.
    """
    costs = choice.compute_costs(pi)
    if bounds is None and not criterion.is_peak:
        return (costs._replace(cost=costs.effort) if criterion is Criterion.EFFORT else costs), None
    demand, bounds = choice.compute_demands(pi), bounds or GripBounds()
    cost = costs.effort if criterion is Criterion.EFFORT else costs.cost
    if criterion is Criterion.MARGIN:
        cost = demand.loads.max(axis=1)
    elif criterion is Criterion.GRIP:
        cost = np.hypot(demand.force, demand.moment / bounds.lever)
    return costs._replace(feasible=costs.feasible & bounds.admit(demand.force, demand.moment), cost=cost), demand


def plan_options(options: Sequence[Option], task: TaskCostModel, settings: Settings) -> Choice:
    """Plans a task with each option, and caches the plans. Options without a feasible plan have infinite cost.

    Raises:
        AffordanceError: There is no option, or two options have the same name.
        ModelFileError: The arm cannot be loaded.
    """
    arm = load_arm(settings.arm)
    return Choice(options, [plan_once(task, option.gripped, settings, arm) for option in options], settings)


def plan_once(task: TaskCostModel, parts: Sequence[PosedShape], settings: Settings, arm: Arm) -> OptionCost:
    """Plans a task with a tool, or returns the cached plan for the same task, geometry, settings and arm.

    If no motion can be planned, the cost is infinite and contains the reason.

    Args:
        task: Task.
        parts: Parts of the tool, posed relative to the hand. Geometries are equal if all shapes, poses and striking
            faces are equal.
        settings: Settings of the controller.
        arm: Arm.
    """
    form = [
        (each.shape, each.X_TE.tobytes(), *((face.p_EQ.tobytes(), face.normal_E.tobytes()) for face in each.strikes))
        for each in parts
    ]
    return _plan(_Work((task, *form), task, parts), settings, arm)


@dataclass(frozen=True)
class _Work:
    """Task with a gripped tool, as a key of the cache. Only ``key`` is compared."""

    key: tuple[object, ...]
    task: TaskCostModel = field(compare=False)
    parts: Sequence[PosedShape] = field(compare=False)


@lru_cache(maxsize=_MOST_PLANS)
def _plan(work: _Work, settings: Settings, arm: Arm) -> OptionCost:
    try:
        return work.task.build_cost(ArmModel(arm), work.parts, settings)
    except AffordanceError as error:
        return _Impossible(str(error), arm.num_joints)


@dataclass(frozen=True)
class _Impossible:
    """Infinite cost of an option for which no motion can be planned."""

    infeasible_reason: str
    num_joints: int

    @property
    def q_start(self) -> Array:
        """Empty array of joint angles, (0,)."""
        return np.zeros(0)

    def compute(self, pi: Array) -> Costs:
        """Returns infinite costs for inertial parameters pi, (S, 10)."""
        return Costs.of_nothing(len(pi))

    def compute_demand(self, pi: Array) -> Demand:
        """Returns infinite loads for inertial parameters pi, (S, 10)."""
        return Demand.of_nothing(self.num_joints, len(pi))
