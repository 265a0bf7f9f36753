"""Clamp and release: push against a stiff clamp with the believed weight of an object, then hold the object.

While the hand is clamped the goal is the present posture, so nothing is corrected: the arm exerts the believed weight
of the object, without feedback. At release the goal becomes the home posture, as in a hold.

At rest in the clamp the torques are those of arm and believed object, tau = tau_arm(q) + J^T w, with w the believed
weight of the object; the clamp is therefore pushed upward by that weight, whatever its posture and stiffness.
"""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel

# The release falls on a control period, up to rounding, [s].
_ROUNDING = 1e-9


class ClampAndRelease:
    """Task of pushing against a clamp and then holding the object."""

    def __init__(self, q_posture: Array, release_time: float) -> None:
        """Stores the posture to hold after release, (num_joints,), [rad], and the time of release, [s]."""
        n = len(q_posture)
        self.release_time = release_time
        self.q_start = np.array(q_posture)
        self._identity, self._at_rest = np.eye(n), np.zeros(n)
        self._goal = TerminalGoal(self._identity, self.q_start, self._identity, self._at_rest)
        for array in self._goal:
            array.setflags(write=False)

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns the longest horizon at all times."""
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns rest in the present posture until release, then rest in the posture to hold."""
        if time < self.release_time - _ROUNDING:
            return self._goal._replace(d_q=x[: len(self._at_rest)])
        return self._goal


def compute_clamp_force(pi: Array, gravity: float) -> float:
    """Computes the upward force on the clamp at rest, [N]: the believed weight.

    Args:
        pi: Believed inertial parameters of the object about To, expressed in T, shape (10,).
        gravity: Gravitational acceleration, [m/s^2].
    """
    return float(pi[0]) * gravity
