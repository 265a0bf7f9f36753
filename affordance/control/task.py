"""What every task offers to a controller."""

from typing import Protocol, runtime_checkable

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel


@runtime_checkable
class Task(Protocol):
    """States where it starts, and its goal at the end of a controller's horizon."""

    @property
    def q_start(self) -> Array:
        """Joint angles in which it begins, at rest, shape (num_joints,), [rad]."""

    def choose_horizon(self, time: float, longest: float) -> float:
        """Chooses how far ahead the controller plans, a multiple of its control period.

        Args:
            time: Now, [s].
            longest: What the controller plans unless there is a reason, [s].

        Returns: At most ``longest``; zero to let the previous plan go on.
        """

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal.

        Args:
            model: The arm, at state x when called and when left.
            x: Joint angles and velocities, shape (2 num_joints,), [rad, rad/s].
            time: Now, [s].
            horizon: How far ahead the goal lies, [s].

        Returns: Linear goal; matrices that stay the same should be the same arrays, whose factor can then be kept.
        """
