"""Tasks of following a path in the world frame W (docs/decisions/0012-reaching.md).

The path is followed by the free end F of a tool T, or by the hand H with constant orientation.
"""

from collections.abc import Iterable

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.trajectories import Trajectory

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.control.task import Task
from affordance.plant.arm_model import ArmModel

# Damping of the least-squares inverse of the Jacobian, [m/rad], or dimensionless for rotations. Velocities are not
# tracked in directions with smaller singular values, for example of an outstretched arm.
_DAMPING = 0.01


class PathFollowing(Task):
    """Task of following a path with a point F of a tool. After the end of the path, F rests at its last point.

    The goal is the position of F on the path at the end of the horizon, and the smallest joint rates with which F has
    the path's velocity there. Null-space motion is thus free but does not drift. The position of F is linearised at
    the posture that the arm reaches at constant joint rates by the end of the horizon. The error is half of the error
    at the present posture (docs/decisions/0012-reaching.md).
    """

    def __init__(self, path: Trajectory, *, q_start: Array, p_WFstart: Array, p_TF: Array) -> None:
        """Stores the path and its start.

        Args:
            path: Positions in W relative to the start, (3, 1), [m].
            q_start: Joint angles at the start, (num_joints,), [rad].
            p_WFstart: Position of F at the start, (3,), [m].
            p_TF: Position of F in the tool, (3,), [m].
        """
        self.q_start = q_start
        self._path = path
        self._p_WFstart = p_WFstart
        self._p_TF = p_TF
        self._every_joint = np.eye(len(q_start))

    def compute_reference(self, time: float) -> tuple[Array, Array]:
        """Computes the reference position, [m], and velocity, [m/s], of F in W, (3,) each."""
        time = min(max(time, self._path.start_time()), self._path.end_time())
        return self._p_WFstart + self._path.value(time)[:, 0], self._path.EvalDerivative(time)[:, 0]

    def list_places(self, times: Iterable[float]) -> Array:
        """Computes the reference positions of F in W at N times, (N, 3), [m]."""
        return np.array([self.compute_reference(time)[0] for time in times])

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal: position on the path and smallest joint rates along it at the end of the horizon."""
        q, v = x[: len(x) // 2], x[len(x) // 2 :]
        q_end = q + horizon * v
        model.set_state(np.concatenate([q_end, v]))
        J, miss, rate = self._compare(model, *self.compute_reference(time + horizon))
        v_least = J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(len(J)), rate)
        return TerminalGoal(J, miss + J @ q_end, self._every_joint, v_least)

    def _compare(self, model: ArmModel, p_WFend: Array, v_WFend: Array) -> tuple[Array, Array, Array]:
        """Computes the Jacobian of F, (3, num_joints), and required displacement and velocity, (3,) each."""
        p_WF = model.compute_point_position(self._p_TF)
        return model.compute_point_jacobian(self._p_TF), p_WFend - p_WF, v_WFend


class Carrying(PathFollowing):
    """Task of following a path with the origin of the hand, without rotation.

    Three additional rows of the goal demand the initial orientation and zero angular velocity.
    """

    def __init__(self, path: Trajectory, *, q_start: Array, X_WHstart: Array) -> None:
        """Stores the path and its start.

        Args:
            path: Positions in W relative to the start, (3, 1), [m].
            q_start: Joint angles at the start, (num_joints,), [rad].
            X_WHstart: Pose of the hand at the start, (4, 4).
        """
        super().__init__(path, q_start=q_start, p_WFstart=X_WHstart[:3, 3], p_TF=np.zeros(3))
        self._R_WHstart = X_WHstart[:3, :3]

    def _compare(self, model: ArmModel, p_WFend: Array, v_WFend: Array) -> tuple[Array, Array, Array]:
        """Computes the hand's Jacobian, (6, num_joints), and required displacement and velocity, (6,) each.

        Rotations precede translations.
        """
        X_WH = model.compute_hand_pose()
        turn_W = AngleAxis(rotation=self._R_WHstart @ X_WH.rotation().matrix().T)
        miss = np.concatenate([turn_W.angle() * turn_W.axis(), p_WFend - X_WH.translation()])
        return model.compute_hand_jacobian(), miss, np.concatenate([np.zeros(3), v_WFend])
