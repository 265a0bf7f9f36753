"""Loads of a motion on joints and gripper, and criteria for comparing options.

If the arm's own inertia dominates, the work hardly differs between grips. Relative joint torques, and force and
moment at the gripper, always differ.
"""

import enum
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS

# Number of samples whose wrenches are in memory at a time, as in motion_cost.py.
_CHUNK = 2000


class Demand(NamedTuple):
    """Largest loads in a motion for each of S inertias."""

    # Largest torque of each joint relative to its limit, (num_joints, S); zero for a joint without a limit.
    loads: Array
    force: Array  # largest force that the hand exerts on the tool, (S,), [N]
    moment: Array  # largest moment about the grip that the hand exerts on the tool, (S,), [N m]

    @classmethod
    def of_nothing(cls, num_joints: int, num_samples: int) -> "Demand":
        """Returns infinite loads, for a motion that no tool can do."""
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
        """True for peak loads, which are compared by their 95 % quantile. Other costs are compared by their mean."""
        return self in (Criterion.MARGIN, Criterion.GRIP)


_UNITS = {Criterion.WORK: "J", Criterion.EFFORT: "N^2 m^2 s", Criterion.MARGIN: "1", Criterion.GRIP: "N"}


def compute_grip_peaks(regressors: Array, pi: Array) -> tuple[Array, Array]:
    """Computes the largest force, [N], and moment about To, [N m], in a motion, (S,) each.

    The wrench that the hand exerts on a tool is linear in the tool's parameters.

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
