"""Loads of a task with a point mass instead of a tool, and each joint's torque margin."""

from typing import Any

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


def measure_payload(task: TaskCostModel, mass: float, p_HQ: Array, settings: Settings) -> dict[str, Any]:
    """Computes the loads of a task with a point mass in the hand.

    The mass is in [kg], its position in the hand's frame (3,), [m].

    Returns: The largest torque of each joint, its limit, and what is left of it (negative if it is exceeded), [N m],
        NaN for a joint without a limit; and the largest force, [N], and moment, [N m], at the grip.

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
    limits = np.asarray(arm.limits.tau_max, dtype=float)
    needed = np.full(limits.shape, np.nan)
    np.multiply(demand.loads[:, 0], limits, out=needed, where=np.isfinite(limits))
    rows = zip(arm.joint_names, needed.tolist(), limits.tolist(), (limits - needed).tolist(), strict=True)
    return {
        "joints": [dict(zip(("joint", "needed", "limit", "margin"), row, strict=True)) for row in rows],
        "grip_force": float(demand.force[0]),
        "grip_moment": float(demand.moment[0]),
    }
