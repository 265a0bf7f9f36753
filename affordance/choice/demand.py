"""Demand of a motion on joints and grip, and the criteria by which options can be compared.

The arm's own inertia may rule its work, so that grips hardly differ by it. What a tool demands of the joints, as a
share of their torque limits, and of the gripper, as force and moment to be held, differs wherever grips do.
"""

import enum
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.serial_chain import SerialChain

# Samples whose wrenches are held in memory at a time, as in motion_cost.py.
_CHUNK = 2000


class Demand(NamedTuple):
    """Greatest demands of a motion under each of S inertias."""

    # Largest torque of each joint relative to its limit, (num_joints, S); zero for a joint without limit.
    loads: Array
    force: Array  # largest force that the hand exerts on the tool, (S,), [N]
    moment: Array  # largest moment about the grip that the hand exerts on the tool, (S,), [N m]

    @classmethod
    def of_nothing(cls, num_joints: int, num_samples: int) -> "Demand":
        """Returns infinite demands of a motion that is infeasible whatever the inertia."""
        nothing = np.full(num_samples, np.inf)
        return cls(np.tile(nothing, (num_joints, 1)), nothing, nothing)


class Criterion(enum.Enum):
    """Criterion by which options are compared."""

    WORK = "work"  # expected absolute work of the joints
    EFFORT = "effort"  # expected integral of |tau|^2
    MARGIN = "margin"  # highest share of a joint's torque limit
    GRIP = "grip"  # wrench that the gripper must hold

    @property
    def unit(self) -> str:
        """Unit of the cost."""
        return _UNITS[self]

    @property
    def is_peak(self) -> bool:
        """True for a peak, compared by its 95 % quantile under the belief; others are compared by their mean."""
        return self in (Criterion.MARGIN, Criterion.GRIP)


_UNITS = {Criterion.WORK: "J", Criterion.EFFORT: "N^2 m^2 s", Criterion.MARGIN: "1", Criterion.GRIP: "N"}


class GripWrench:
    """Wrench that the hand exerts on the tool during a motion, linear in the tool's inertial parameters."""

    def __init__(self, chain: SerialChain, q: Array, v: Array, vdot: Array) -> None:
        """Computes the regressors at N nodes of a motion; arrays are (N, num_joints), [rad, rad/s, rad/s^2]."""
        self._W = chain.compute_wrench_regressors(q, v, vdot).reshape(-1, NUM_PARAMETERS)

    def compute_peaks(self, pi: Array) -> tuple[Array, Array]:
        """Computes the largest force, [N], and moment about To, [N m], (S,) each, for parameters pi, (S, 10)."""
        force, moment = np.empty((2, len(pi)))
        for start in range(0, len(pi), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            squares = np.square(self._W @ pi[chunk].T)
            squares = squares.reshape(-1, 2, 3, squares.shape[1]).sum(axis=2).max(axis=0)
            moment[chunk], force[chunk] = np.sqrt(squares)
        return force, moment
