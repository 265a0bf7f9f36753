"""Protocol of the tasks of the controller."""

from typing import Protocol, runtime_checkable

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel


@runtime_checkable
class Task(Protocol):
    """Task with a start posture, and a goal at the end of the controller's horizon."""

    @property
    def q_start(self) -> Array:
        """Joint angles at the start, at rest, shape (num_joints,), [rad]."""

    def choose_horizon(self, time: float, longest: float) -> float:
        """Chooses the horizon of the controller, a multiple of its control period.

        Args:
            time: Present time, [s].
            longest: Default horizon of the controller, [s].

        Returns: Horizon, at most ``longest``, [s]; zero to continue the previous plan.
        """

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal at the end of the horizon.

        Args:
            model: Model of the arm; its state may be changed.
            x: Joint angles and velocities, shape (2 num_joints,), [rad, rad/s].
            time: Present time, [s].
            horizon: Time until the goal, [s].

        Returns: Linear goal; matrices that do not change should be the same arrays, so that their factor is kept.
        """
