"""Interface of the controller's tasks, start postures, and the task of holding an object still.

The goal of a hold is a posture of all joints. It includes the pose of the hand, so nothing must be linearised
(docs/decisions/0005-controller.md).
"""

import math
from pathlib import Path
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from pydantic import Field

from affordance.arrays import Array
from affordance.control.problem import TerminalGoal
from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.constraints import Within
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel


@runtime_checkable
class Task(Protocol):
    """Task of the controller: a start posture, and a goal for the end of each horizon."""

    q_start: Array  # joint angles at the start, at rest, shape (num_joints,), [rad]

    def choose_horizon(self, time: float, longest: float) -> float:
        """Returns the horizon, [s], by default the longest. Zero continues the previous plan.

        Args:
            time: Time since the start of the task, [s].
            longest: Longest horizon, [s]. All horizons are integer multiples of the control period.
        """
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal at the end of the horizon.

        Constant matrices should be the same arrays in each call, so that results can be cached.

        Args:
            model: Model of the arm; its state may be changed.
            x: Present angles and rates, (2 num_joints,), [rad, rad/s].
            time: Time since the start of the task, [s].
            horizon: Horizon, [s].
        """


# Start posture: names and angles, [rad], of joints that are not at their home angles.
type Start = tuple[tuple[str, float], ...]


# Start posture in a file, which is the home posture if the entry is omitted.
type StartEntry = Annotated[
    dict[str, Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi)]],
    Field(description="Joints whose start angle differs from the home posture, and their angles, [rad]."),
]


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Checks that a start posture from a task file is valid for an arm.

    Raises:
        BadValueError: A joint is unknown, or an angle exceeds its limits. The message contains file, key and joint.
    """
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error


class Hold(Task):
    """Task of holding an object still."""

    def __init__(self, q_posture: Array) -> None:
        """Stores the joint angles to hold, (num_joints,), [rad]."""
        identity = np.eye(len(q_posture))
        self.q_start = np.array(q_posture)
        self._goal = TerminalGoal(identity, self.q_start, identity, np.zeros(len(q_posture)))
        for array in self._goal:
            array.setflags(write=False)

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns the goal, which is always rest in the given posture."""
        return self._goal
