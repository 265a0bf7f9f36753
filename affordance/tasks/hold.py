"""Hold: keep the hand where it is, and the arm in its posture.

The goal is the hand's pose and, in its null space, the posture: with the pose alone a wrong belief lets the elbow
swivel. Both are linearised at the current state and merged into the joint angles to reach, those that minimise

    |J (q_N - q) - e|^2 + damping^2 |q_N - q_posture|^2

with J the hand's Jacobian and e what its pose is off. In closed form that is the posture, corrected by damped least
squares, which stays calm where the straight arm is singular.
"""

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
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
        self._error_map, self._error_offset = _linearise_pose_error(self.X_WH)
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
        e = self._error_map @ model.compute_hand_pose().GetAsMatrix34().ravel() + self._error_offset
        J = model.compute_hand_jacobian()
        off_posture = self.q_posture - x[: len(self.q_posture)]
        _, correction, _ = dposv(J @ J.T + self._damping, e - J @ off_posture)
        return TerminalGoal(self._identity, self.q_posture + correction @ J, self._identity, self._rest)


def _linearise_pose_error(X_WG: RigidTransform) -> tuple[Array, Array]:
    """Writes what a pose X_WH is off a goal X_WG as an affine function of X_WH's entries.

    The rotation's part is its axis times the sine of its angle: the skew part of R_WG R_WH^T, linear in R_WH. The
    translation's part is p_WG - p_WH.

    Returns: A of shape (6, 12) and b of shape (6,) such that A vec([R_WH | p_WH]) + b = e, in row-major order.
    """
    A, b = np.zeros((6, 3, 4)), np.zeros(6)
    R_WG = X_WG.rotation().matrix()
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        # e_axis = (Q_ji - Q_ij) / 2 with Q = R_WG R_WH^T, where Q_ji = R_WG[j] . R_WH[i].
        A[axis, i, :3] = 0.5 * R_WG[j]
        A[axis, j, :3] = -0.5 * R_WG[i]
    A[3:, :, 3] = -np.eye(3)
    b[3:] = X_WG.translation()
    return A.reshape(6, 12), b
