"""Mobility of a tool point, which shows how far an arm is from a singular posture.

Mobility is the smallest singular value of the point's translational Jacobian Jv_v_WQ: the motion of the point per
radian of joint motion, in the worst direction. An outstretched arm has zero mobility. Near such a posture, a small
displacement of the point can require an arbitrarily large joint motion, so results cannot be trusted.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel

# Least admissible mobility, [m/rad]. Damped least squares with 0.01 m (control.path_following) then loses 4 % of the
# required velocity in that direction: 0.01^2 / (0.05^2 + 0.01^2).
MIN_MOBILITY = 0.05
# Angle by which each joint is bent to find which joint raises mobility most, [rad].
_BEND = 0.1


def compute_mobility(model: ArmModel, q: Array, p_TQ: Array) -> float:
    """Computes the mobility of a point Q fixed to the tool, [m/rad].

    Args:
        model: Arm model. It remains in posture q.
        q: Joint angles, (num_joints,), [rad].
        p_TQ: Position of Q in the tool, (3,), [m].
    """
    model.set_posture(q)
    return float(np.linalg.svd(model.compute_point_jacobian(p_TQ), compute_uv=False)[-1])


def describe_rank_loss(model: ArmModel, q: Array, p_TQ: Array) -> str:
    """Explains why a posture is too close to a singularity, and which joint to bend.

    Arguments are the same as for ``compute_mobility``.

    Returns:
        The explanation; empty if the posture is acceptable.
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
