"""Tasks of holding an object where it was handed over, and of pushing against a clamp before its release.

The goal of a hold is the hand's pose and, in its null space, the arm's posture. A posture determines the hand's pose,
so the joint angles closest to both are exactly those of the posture, and nothing needs to be linearised
(docs/decisions/0005-controller.md).

Before the release the hand is clamped. The goal is then the present posture, so nothing is corrected: the arm exerts
the believed weight of the object without feedback. At rest in the clamp the torques are tau = tau_arm(q) + J^T w,
where w is the believed weight. The hand therefore pushes the clamp upwards with that weight, whatever the arm's
posture and the clamp's stiffness.
"""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.task import Task
from affordance.plant.arm_model import ArmModel

# Tolerance for the time of release, which is a multiple of the control period, [s].
_ROUNDING = 1e-9


class Hold(Task):
    """Task of holding an object where it was handed over."""

    def __init__(self, q_posture: Array) -> None:
        """Stores the joint angles to hold, (num_joints,), [rad]."""
        identity = np.eye(len(q_posture))
        self.q_start = np.array(q_posture)
        self._goal = TerminalGoal(identity, self.q_start, identity, np.zeros(len(q_posture)))
        for array in self._goal:
            array.setflags(write=False)

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns the goal of rest in the posture to hold, whatever the state and time."""
        return self._goal


class ClampAndRelease(Hold):
    """Task of pushing against a clamp and then holding the object."""

    def __init__(self, q_posture: Array, release_time: float) -> None:
        """Stores the joint angles to hold after release, (num_joints,), [rad], and the time of release, [s]."""
        super().__init__(q_posture)
        self.release_time = release_time

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns the goal of rest in the present posture until release, and then in the posture to hold."""
        if time < self.release_time - _ROUNDING:
            return self._goal._replace(d_q=x[: len(self.q_start)])
        return self._goal
