"""Mobility of a tool point: distance of an arm from singular postures.

Mobility is the least singular value of the point's translational Jacobian Jv_v_WQ: the least motion of the point per
radian of joint motion, over all directions. An outstretched arm has zero mobility. Close to such a posture, the
required joint motion depends on the point's position without bound, and results computed from it cannot be trusted.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel

# Least admissible mobility, [m/rad]. Damped least squares with 0.01 m (control.path_following) then misses 4 % of the
# demanded velocity in that direction: 0.01^2 / (0.05^2 + 0.01^2).
MIN_MOBILITY = 0.05
# Angle by which each joint is bent to find the one that raises mobility most, [rad].
_BEND = 0.1


def compute_mobility(model: ArmModel, q: Array, p_TQ: Array) -> float:
    """Computes the mobility of a point Q of the tool, [m/rad]. The model is set to posture q.

    The angles q are (num_joints,), [rad]; the point's position p_TQ in the tool is (3,), [m].
    """
    model.set_posture(q)
    return float(np.linalg.svd(model.compute_point_jacobian(p_TQ), compute_uv=False)[-1])


def describe_rank_loss(model: ArmModel, q: Array, p_TQ: Array) -> str:
    """Describes why a posture is too close to a singularity, and which joint to bend.

    The text is empty for other postures.

    Arguments are as in ``compute_mobility``.
    """
    mobility = compute_mobility(model, q, p_TQ)
    if mobility >= MIN_MOBILITY:
        return ""
    limits = model.arm.limits
    bent = [
        max(
            compute_mobility(model, np.clip(q + sign * step, limits.q_lower, limits.q_upper), p_TQ)
            for sign in (1.0, -1.0)
        )
        for step in _BEND * np.eye(len(q))
    ]
    joint = model.arm.joint_names[int(np.argmax(bent))]
    return (
        f"moves the free end by {mobility:.3g} m per rad in its worst direction, must be at least {MIN_MOBILITY:g}; "
        f"bend {joint}, which raises it most"
    )
