"""Reach: the free end of the tool follows a path in space."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.trajectories import Trajectory

from affordance.acceleration_program import TerminalGoal
from affordance.arm import ArmModel
from affordance.exceptions import NoPlanError
from affordance.kinematics import build_chain
from affordance.paths import TimedPath
from affordance.planned_motion import MotionEnergies, plan_motion
from affordance.settings import Settings
from affordance.tools import Placed, find_free_end

Array = NDArray[np.float64]

# Directions in which F moves less than this per radian of the joints are not followed in velocity: a straight arm has
# one, [m].
_DAMPING = 0.01


@dataclass(frozen=True)
class Reach:
    """What is asked of any tool: to follow a path with its free end F, from where the home posture holds it."""

    path: TimedPath

    @property
    def duration(self) -> float:
        """How long it takes, [s]."""
        return self.path.duration

    def begin(self, model: ArmModel, p_TF: Array) -> "Following":
        """Makes the task for one tool.

        Args:
            model: The arm; its state is set to rest in the home posture.
            p_TF: The tool's free end, shape (3,), [m].
        """
        home = model.arm.home
        model.set_state(np.concatenate([home, np.zeros(len(home))]))
        return Following(self.path.build_trajectory(), model.compute_point_position(p_TF), p_TF, len(home))

    def build_energies(self, model: ArmModel, parts: Sequence[Placed], settings: Settings) -> MotionEnergies:
        """Plans the motion, which is the same whatever the tool weighs, and returns what it costs at any inertia.

        Args:
            model: The arm; its state is set.
            parts: What the tool is made of, posed relative to the hand.
            settings: Those of the controller.

        Raises:
            NoPlanError: The controller finds no plan.
        """
        p_TF = find_free_end(parts)
        following = self.begin(model, p_TF)
        try:
            motion = plan_motion(model, following, duration=self.duration, settings=settings)
        except NoPlanError as found:
            raise NoPlanError(found.time, self.path.name_nearest_point(found.time)) from found
        places = build_chain(model.arm).compute_positions(motion.q, p_TF)
        asked = following.list_places([motion.tick * k for k in range(len(motion.q))])
        error = float(np.linalg.norm(places - asked, axis=1).max())
        return MotionEnergies(model, motion, obstacle=self.path.describe_error(error))


class Following:
    """The task of following a path with a point F of a certain tool.

    Its goal is F's place on the path where the horizon ends, and of all joint rates that give F the path's velocity
    there the least: where the rest of the arm goes is its own affair, but it is not to drift. Linear in the joint
    angles the place is only near some posture: it is linearised where the arm would coast to by then, which errs less
    by half than at the present posture (docs/decisions/0012-reaching.md).
    """

    def __init__(self, path: Trajectory, p_WFstart: Array, p_TF: Array, num_joints: int) -> None:
        """Takes the path relative to its start, the start in W, and the free end in T, shape (3,) each, [m]."""
        self._path = path
        self._p_WFstart = p_WFstart
        self._p_TF = p_TF
        self._every_joint = np.eye(num_joints)

    def compute_reference(self, time: float) -> tuple[Array, Array]:
        """Place and velocity of F at a time, p_WF and v_WF, shape (3,) each, [m, m/s]."""
        time = min(max(time, self._path.start_time()), self._path.end_time())
        return self._p_WFstart + self._path.value(time)[:, 0], self._path.EvalDerivative(time)[:, 0]

    def list_places(self, times: Iterable[float]) -> Array:
        """Where F is to be at N times, p_WF, (N, 3), [m]."""
        return np.array([self.compute_reference(time)[0] for time in times])

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns the longest there is, at all times: beyond its end the path stays where it is."""
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Asks for the path's place and the least rates along it at the horizon's end."""
        q, v = np.split(x, 2)
        q_end = q + horizon * v
        model.set_state(np.concatenate([q_end, v]))
        p_WF = model.compute_point_position(self._p_TF)
        J = model.compute_point_jacobian(self._p_TF)
        model.set_state(x)
        p_WFend, v_WFend = self.compute_reference(time + horizon)
        v_least = J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(3), v_WFend)
        return TerminalGoal(J, p_WFend - p_WF + J @ q_end, self._every_joint, v_least)
