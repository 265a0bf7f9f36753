"""Joint torques and grip wrench of a task with a point mass in the hand."""

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

# Semi-axis of the small sphere that represents the payload in tasks that need a shape, [m].
_POINT = 1e-3


def measure_payload(task: TaskCostModel, mass: float, p_HQ: Array, settings: Settings) -> dict[str, Any]:
    """Computes joint torques and the grip wrench of a task with a point mass in the hand.

    Args:
        task: Task.
        mass: Mass of the payload, [kg].
        p_HQ: Position of the payload in the hand frame, (3,), [m].
        settings: Settings of the arm.

    Returns: Largest torque, limit and remaining margin of each joint, [N m]; largest force, [N], and moment, [N m],
        at the grip. Margins are negative if a limit is exceeded, and NaN for joints without a limit.

    Raises:
        BadValueError: The task cannot be planned with this payload.
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
