"""Holding, and clamp and release: hand and object are kept where the object was handed over.

The goal of a hold is the hand's pose and, in its null space, the arm's posture. A posture determines the hand's pose,
so the joint angles closest to both are exactly those of the posture: nothing needs to be linearised
(docs/decisions/0005-controller.md).

Before a release the hand is clamped, and the goal is the present posture, so nothing is corrected: the arm exerts the
believed weight of the object, without feedback. At rest in the clamp the torques are those of arm and believed
object, tau = tau_arm(q) + J^T w, with w the believed weight; the clamp is therefore pushed upward by that weight,
whatever its posture and stiffness.
"""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.task import Task
from affordance.plant.arm_model import ArmModel

# The release falls on a control period, up to rounding, [s].
_ROUNDING = 1e-9


class Hold(Task):
    """Task of holding an object where it was handed over."""

    def __init__(self, q_posture: Array) -> None:
        """Stores the posture to hold, joint angles of shape (num_joints,), [rad]."""
        identity = np.eye(len(q_posture))
        self.q_start = np.array(q_posture)
        self._goal = TerminalGoal(identity, self.q_start, identity, np.zeros(len(q_posture)))
        for array in self._goal:
            array.setflags(write=False)

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns rest in the posture to hold, independently of state and time."""
        return self._goal


class ClampAndRelease(Hold):
    """Task of pushing against a clamp and then holding the object."""

    def __init__(self, q_posture: Array, release_time: float) -> None:
        """Stores the posture to hold after release, (num_joints,), [rad], and the time of release, [s]."""
        super().__init__(q_posture)
        self.release_time = release_time

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns rest in the present posture until release, then rest in the posture to hold."""
        if time < self.release_time - _ROUNDING:
            return self._goal._replace(d_q=x[: len(self.q_start)])
        return self._goal
