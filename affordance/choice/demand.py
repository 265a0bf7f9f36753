"""Peak loads of a motion on joints and gripper, and criteria for comparing options.

If the arm's inertia dominates, work hardly differs between grips, but joint torques and the wrench at the gripper do.
"""

import enum
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS

# Number of samples whose wrenches are computed at a time, to limit memory as in motion_cost.py.
_CHUNK = 2000


class Demand(NamedTuple):
    """Peak loads of a motion for each of S inertias."""

    # Peak torque of each joint relative to its limit, (num_joints, S); zero for a joint without a limit.
    loads: Array
    force: Array  # peak force of the hand on the tool, (S,), [N]
    moment: Array  # peak moment of the hand on the tool about the grip, (S,), [N m]

    @classmethod
    def of_nothing(cls, num_joints: int, num_samples: int) -> "Demand":
        """Returns infinite loads, for an impossible motion."""
        nothing = np.full(num_samples, np.inf)
        return cls(np.tile(nothing, (num_joints, 1)), nothing, nothing)


class Criterion(enum.Enum):
    """Criterion by which options are compared."""

    WORK = "work"  # expected absolute work of the joints
    EFFORT = "effort"  # expected integral of |tau|^2
    MARGIN = "margin"  # highest fraction of a joint's torque limit
    GRIP = "grip"  # wrench that the gripper must hold

    @property
    def unit(self) -> str:
        """Unit of the cost."""
        return _UNITS[self]

    @property
    def is_peak(self) -> bool:
        """True if the cost is a peak load, which is compared by its 95 % quantile instead of its mean."""
        return self in (Criterion.MARGIN, Criterion.GRIP)


_UNITS = {Criterion.WORK: "J", Criterion.EFFORT: "N^2 m^2 s", Criterion.MARGIN: "1", Criterion.GRIP: "N"}


def compute_grip_peaks(regressors: Array, pi: Array) -> tuple[Array, Array]:
    """Computes the peak force, [N], and the peak moment about To, [N m], of the hand on a tool, (S,) each.

    The wrench is linear in the tool's inertial parameters.

    Args:
        regressors: Wrench regressors at N nodes of the motion, (N, 6, 10).
        pi: Inertial parameters, (S, 10).
    """
    W = regressors.reshape(-1, NUM_PARAMETERS)
    force, moment = np.empty((2, len(pi)))
    for start in range(0, len(pi), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        squares = np.square(W @ pi[chunk].T)
        squares = squares.reshape(-1, 2, 3, squares.shape[1]).sum(axis=2).max(axis=0)
        moment[chunk], force[chunk] = np.sqrt(squares)
    return force, moment
