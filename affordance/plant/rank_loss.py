"""Distance of an arm from postures in which a point of its tool cannot move in every direction.

The measure is the least singular value of the point's translational Jacobian Jv_v_WQ: the motion of the point per
radian of the joints, in the direction in which it moves least. It is zero in an outstretched arm, along the arm.
There the joint motion that moves the point depends on the point's position without bound, and no choice computed from
it can be trusted.
"""

import numpy as np

from affordance.arrays import Array
from affordance.plant.arm_model import ArmModel

# Least admissible mobility. Least rates damped by 0.01 m (control.path_following) then miss 4 % of the demanded
# velocity in that direction, 0.01^2 / (0.05^2 + 0.01^2), [m/rad].
MIN_MOBILITY = 0.05
# Angle by which joints are bent to find which of them leads away from rank loss, [rad].
_BEND = 0.1


def compute_mobility(model: ArmModel, q: Array, p_TQ: Array) -> float:
    """Computes the least singular value of the Jacobian of a point Q of the tool, [m/rad], and sets the model to q.

    The angles q are (num_joints,), [rad]; the point's place p_TQ in the tool is (3,), [m].
    """
    model.set_posture(q)
    return float(np.linalg.svd(model.compute_point_jacobian(p_TQ), compute_uv=False)[-1])


def describe_rank_loss(model: ArmModel, q: Array, p_TQ: Array) -> str:
    """Describes how a posture is too close to rank loss, and which joint leads away; empty if it is not.

    Arguments as for ``compute_mobility``.
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
