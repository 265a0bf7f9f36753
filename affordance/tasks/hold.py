"""Hold: keep the hand where it is, and the arm in its posture.

The goal is the hand's pose and, in its null space, the posture: with the pose alone a wrong belief lets the elbow
swivel. Both are linearised at the current state and merged into the joint angles to reach, those that minimise

    |J (q_N - q) - e|^2 + damping^2 |q_N - q_posture|^2

with J the hand's Jacobian and e what its pose is off. In closed form that is the posture, corrected by damped least
squares, which stays calm where the straight arm is singular.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from affordance.acceleration_program import TerminalGoal
from affordance.arm import ArmModel

Array = NDArray[np.float64]

# The pose comes first: 1 rad off the posture counts as little as 5 cm, or 0.05 rad, off the pose.
_DAMPING = 0.05


class Hold:
    """The task of holding an object where it was given.

    Attributes:
        q_posture: Joint angles of the posture, shape (num_joints,), [rad].
        X_WH: Pose of the hand in that posture.
    """

    def __init__(self, model: ArmModel, q_posture: Array) -> None:
        """Takes posture and hand pose to hold; leaves the model in that posture."""
        num_joints = len(q_posture)
        model.set_state(np.concatenate([q_posture, np.zeros(num_joints)]))
        self.q_posture = q_posture
        self.X_WH = model.compute_hand_pose()
        self._R_WH = self.X_WH.rotation().matrix()
        self._p_WH = self.X_WH.translation()
        # The same arrays in every goal: the controller recognises them and keeps their factor.
        self._identity = np.eye(num_joints)
        self._rest = np.zeros(num_joints)
        self._damping = _DAMPING**2 * np.eye(6)

    def compute_goal(self, model: ArmModel, x: Array) -> TerminalGoal:
        """Computes the goal for the end of the horizon.

        Args:
            model: The arm, already at state x.
            x: Joint angles and rates, shape (2 num_joints,), [rad, rad/s].

        Returns: Rest at the joint angles that restore pose and posture.
        """
        X_WH = model.compute_hand_pose()
        R_error = self._R_WH @ X_WH.rotation().matrix().T
        e = np.empty(6)
        # Rotation vector to first order: axis times sine of the angle.
        e[0] = 0.5 * (R_error[2, 1] - R_error[1, 2])
        e[1] = 0.5 * (R_error[0, 2] - R_error[2, 0])
        e[2] = 0.5 * (R_error[1, 0] - R_error[0, 1])
        e[3:] = self._p_WH - X_WH.translation()
        J = model.compute_hand_jacobian()
        off_posture = self.q_posture - x[: len(self.q_posture)]
        _, correction, _ = dposv(J @ J.T + self._damping, e - J @ off_posture)
        return TerminalGoal(self._identity, self.q_posture + correction @ J, self._identity, self._rest)
