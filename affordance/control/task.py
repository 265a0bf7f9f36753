"""Interface of the controller's tasks."""

from typing import Protocol, runtime_checkable

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.plant.arm_model import ArmModel


@runtime_checkable
class Task(Protocol):
    """Task with a start posture, and a goal at the end of the controller's horizon."""

    q_start: Array  # joint angles at the start, at rest, shape (num_joints,), [rad]

    def choose_horizon(self, time: float, longest: float) -> float:
        """Chooses the horizon, [s], a whole number of control periods; zero continues the previous plan.

        By default it is the longest one.
        """
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal at the end of the horizon, [s], from the state x, (2 num_joints,), [rad, rad/s].

        The model's state may be changed. Matrices that do not change should be the same arrays in every call, so that
        their factors can be cached.
        """
