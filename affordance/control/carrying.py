"""Task of carrying: the hand H follows a path in the world W and keeps the orientation that it starts with."""

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.trajectories import Trajectory
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.control.path_following import PathFollowing
from affordance.plant.arm_model import ArmModel


class Carrying(PathFollowing):
    """Task of following a path with the hand, F = Ho, without turning it.

    The goal has three more rows: the first orientation, and no rate of turning.
    """

    def __init__(self, path: Trajectory, *, q_start: Array, X_WHstart: Array) -> None:
        """Stores the path, in W, relative to its start, and the angles, [rad], and the hand's pose, (4, 4), there."""
        super().__init__(path, q_start=q_start, p_WFstart=X_WHstart[:3, 3], p_TF=np.zeros(3))
        self._R_WHstart = X_WHstart[:3, :3]

    def _compare(self, model: ArmModel, p_WFend: Array, v_WFend: Array) -> tuple[Array, Array, Array]:
        """Returns the hand's Jacobian, (6, num_joints), displacement and rate, (6,), each turning first."""
        X_WH = model.compute_hand_pose()
        miss = np.concatenate([self._compute_turn(X_WH.rotation()), p_WFend - X_WH.translation()])
        return model.compute_hand_jacobian(), miss, np.concatenate([np.zeros(3), v_WFend])

    def _compute_turn(self, R_WH: RotationMatrix) -> Array:
        """Computes the rotation vector in W that turns the hand back to its first orientation, (3,), [rad]."""
        turn_W: Array = Rotation.from_matrix(self._R_WHstart @ R_WH.matrix().T).as_rotvec()
        return turn_W
