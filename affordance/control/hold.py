"""Holding: hand and object are kept where the object was handed over.

The goal is the hand's pose and, in its null space, the arm's posture. A posture determines the hand's pose, so the
joint angles closest to both are exactly those of the posture: nothing needs to be linearised
(docs/decisions/0010-goal-of-a-hold.md).
"""

import numpy as np

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel


class Hold:
    """Task of holding an object where it was handed over."""

    def __init__(self, q_posture: Array) -> None:
        """Stores the posture to hold, joint angles of shape (num_joints,), [rad]."""
        identity = np.eye(len(q_posture))
        self.q_start = np.array(q_posture)
        self._goal = TerminalGoal(identity, self.q_start, identity, np.zeros(len(q_posture)))
        for array in self._goal:
            array.setflags(write=False)

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns the longest horizon at all times."""
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns rest in the posture to hold, independently of state and time."""
        return self._goal
