"""Task of carrying: the hand H follows a path in the world W and keeps the orientation that it starts with."""

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.trajectories import Trajectory
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel

# Directions in which the hand moves less than this per radian of the joints are not tracked in velocity, as in
# path_following.py, [m] and [rad].
_DAMPING = 0.01


class Carrying:
    """Task of following a path with the hand, without turning it.

    As in ``PathFollowing``, the goal is linearised at the posture to which the arm would coast.
    """

    def __init__(self, path: Trajectory, *, q_start: Array, X_WHstart: Array) -> None:
        """Stores the path and the pose to start from.

        Args:
            path: Path relative to its start, expressed in W.
            q_start: Joint angles at the start, shape (num_joints,), [rad].
            X_WHstart: Pose of the hand at the start, shape (4, 4).
        """
        self.q_start = q_start
        self._path = path
        self._X_WHstart = X_WHstart
        self._every_joint = np.eye(len(q_start))

    def compute_reference(self, time: float) -> tuple[Array, Array]:
        """Computes reference position and velocity of the hand at a time, p_WH and v_WH, (3,) each, [m, m/s]."""
        time = min(max(time, self._path.start_time()), self._path.end_time())
        return self._X_WHstart[:3, 3] + self._path.value(time)[:, 0], self._path.EvalDerivative(time)[:, 0]

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns the longest horizon at all times: after its end the path stays at its last point."""
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal: the path's position, the first orientation, and the least rates along the path."""
        q, v = x[: len(x) // 2], x[len(x) // 2 :]
        q_end = q + horizon * v
        model.set_state(np.concatenate([q_end, v]))
        X_WH, J = model.compute_hand_pose(), model.compute_hand_jacobian()
        p_WHend, v_WHend = self.compute_reference(time + horizon)
        turn_W = self._compute_turn(X_WH.rotation())
        miss = np.concatenate([turn_W, p_WHend - X_WH.translation()])
        rate = np.concatenate([np.zeros(3), v_WHend])
        v_least = J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(6), rate)
        return TerminalGoal(J, miss + J @ q_end, self._every_joint, v_least)

    def _compute_turn(self, R_WH: RotationMatrix) -> Array:
        """Computes the rotation vector in W that turns the hand back to its first orientation, (3,), [rad]."""
        turn_W: Array = Rotation.from_matrix(self._X_WHstart[:3, :3] @ R_WH.matrix().T).as_rotvec()
        return turn_W
