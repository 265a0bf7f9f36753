"""Loads of a task with a payload of known mass in place of a tool, and the torque margin of each joint."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.choice.inner_simulation import TaskCostModel
from affordance.exceptions import AffordanceError, BadValueError
from affordance.objects.inertia import Ellipsoid, compute_point_parameters
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import Settings
from affordance.vision.features import ComponentFeatures

# Size of the small body that represents the payload in tasks that need a shape, [m].
_POINT = 1e-3


class JointMargin(NamedTuple):
    """Largest torque of a joint during a task, its limit, and its margin, [N m]."""

    joint: str
    needed: float
    limit: float

    @property
    def margin(self) -> float:
        """Torque that remains up to the limit, [N m]; negative if the limit is exceeded."""
        return self.limit - self.needed


class PayloadDemand(NamedTuple):
    """Loads of a task with a payload."""

    joints: tuple[JointMargin, ...]
    force: float  # largest force at the grip, [N]
    moment: float  # largest moment about the grip, [N m]


def measure_payload(task: TaskCostModel, mass: float, p_HQ: Array, settings: Settings) -> PayloadDemand:
    """Computes the loads of a task with a point mass, [kg], at a position in the hand's frame, (3,), [m].

    Raises:
        BadValueError: If the task cannot be planned with it.
    """
    arm = load_arm(settings.arm)
    X = np.eye(4)
    X[:3, 3] = p_HQ
    point = ComponentFeatures((0.5, 0.5, 0.5), Ellipsoid((_POINT,) * 3), X)
    try:
        cost = task.build_cost(ArmModel(arm), [point], settings)
    except AffordanceError as error:
        raise BadValueError("--payload", "", f"cannot do the task: {error}") from error
    if cost.infeasible_reason:
        raise BadValueError("--payload", "", f"cannot do the task: it {cost.infeasible_reason}")
    demand = cost.compute_demand(mass * compute_point_parameters(np.asarray(p_HQ, dtype=float))[None])
    limits = arm.limits.tau_max
    joints = tuple(
        JointMargin(name, float(load * limit) if np.isfinite(limit) else np.nan, float(limit))
        for name, load, limit in zip(arm.joint_names, demand.loads[:, 0], limits, strict=True)
    )
    return PayloadDemand(joints, float(demand.force[0]), float(demand.moment[0]))
