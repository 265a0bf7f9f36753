"""Limits of an arm's joints."""

from typing import NamedTuple

from affordance.arrays import Array


class JointLimits(NamedTuple):
    """Limits of the joints, each of shape (num_joints,); infinite for an unlimited joint."""

    q_lower: Array  # [rad]
    q_upper: Array  # [rad]
    v_max: Array  # on |v|, [rad/s]
    tau_max: Array  # on |tau|, [N m]
