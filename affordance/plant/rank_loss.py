"""How near an arm is to a posture in which a point of its tool cannot move in every direction.

The measure is the least singular value of the point's translational Jacobian Jv_v_WQ: how far the point moves per
radian of the joints, in the direction in which it moves least. It is zero in an outstretched arm, along the arm.
There the motion that moves the point changes without bound with where the point is, and no choice that is computed
from it is to be trusted.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel

# The least there must be. Least rates that are damped by 0.01 m (control.path_following) then miss 4 % of the
# velocity that is asked for in that direction, 0.01^2 / (0.05^2 + 0.01^2), [m/rad].
MIN_MOBILITY = 0.05
# By how much joints are bent to find which of them leads away, [rad].
_BEND = 0.1


def compute_mobility(model: ArmModel, q: Array, p_TQ: Array) -> float:
    """Least singular value of the translational Jacobian of a point Q of the tool, [m/rad].

    Args:
        model: The arm; its state is set.
        q: Joint angles, shape (num_joints,), [rad].
        p_TQ: The point, shape (3,), [m].
    """
    model.set_state(np.concatenate([q, np.zeros(len(q))]))
    return float(np.linalg.svd(model.compute_point_jacobian(p_TQ), compute_uv=False)[-1])


def describe_rank_loss(model: ArmModel, q: Array, p_TQ: Array) -> str:
    """Says that a posture is too near rank loss, by how much, and which joint leads away; empty if it is not.

    Arguments are those of ``compute_mobility``.
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
