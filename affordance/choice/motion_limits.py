"""Words for what limits a planned motion: the joint that is at its limit where the motion fails."""

import numpy as np

from affordance.choice.motion_cost import PlannedMotion
from affordance.plant.arm import Arm

# Distance from a limit of angle that counts as being at it, [rad], and share of a limit of rate.
_NEAR, _SHARE = 0.02, 0.98


def describe_limit(arm: Arm, motion: PlannedMotion, row: int) -> str:
    """Describes which joint is at a limit in a row of a motion, and at which."""
    q, v, limits = motion.q[row], motion.v[row], arm.limits
    gaps = np.minimum(q - limits.q_lower, limits.q_upper - q)
    joint = int(np.argmin(gaps))
    if gaps[joint] <= _NEAR:
        lower, upper = limits.q_lower[joint], limits.q_upper[joint]
        limit = lower if q[joint] - lower < upper - q[joint] else upper
        return f"where {arm.joint_names[joint]} is at its limit of {limit:.3g} rad"
    shares = np.abs(v) / limits.v_max
    joint = int(np.argmax(shares))
    if shares[joint] >= _SHARE:
        return f"where {arm.joint_names[joint]} is at its limit of {limits.v_max[joint]:.3g} rad/s"
    return f"where no joint is at a limit: the arm is too short, or its {len(q)} joints are too few"
