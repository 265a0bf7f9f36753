"""Tasks of the controller: interface, start postures, and holding an object still.

The goal of a hold is the hand's pose and, in its null space, the arm's posture. A posture determines the hand's pose,
so the posture itself is closest to both goals, and nothing needs to be linearised
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
    """Task with a start posture, and a goal at the end of the controller's horizon."""

    q_start: Array  # joint angles at the start, at rest, shape (num_joints,), [rad]

    def choose_horizon(self, time: float, longest: float) -> float:
        """Chooses the horizon, [s], as a whole number of control periods. Zero continues the previous plan.

        By default it is the longest horizon.
        """
        return longest

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Computes the goal at the end of the horizon, [s]. The state x is (2 num_joints,), [rad, rad/s].

        The model's state may be changed. Matrices that do not change should be the same arrays in every call, so that
        their factors can be cached.
        """


# Start posture: names and angles, [rad], of the joints that differ from the home posture.
type Start = tuple[tuple[str, float], ...]


# Start posture in a file; omitted if a task starts in the home posture.
type StartEntry = Annotated[
    dict[str, Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi)]],
    Field(description="Joints whose start angle differs from the home posture, and their angles, [rad]."),
]


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Checks that the arm can take a start posture from a task file.

    Otherwise a BadValueError names the file, ``key``, and the joint.
    """
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error


class Hold(Task):
    """Task of holding an object where it was handed over."""

    def __init__(self, q_posture: Array) -> None:
        """Stores the joint angles to hold, (num_joints,), [rad]."""
        identity = np.eye(len(q_posture))
        self.q_start = np.array(q_posture)
        self._goal = TerminalGoal(identity, self.q_start, identity, np.zeros(len(q_posture)))
        for array in self._goal:
            array.setflags(write=False)

    def compute_goal(self, model: ArmModel, x: Array, time: float, horizon: float) -> TerminalGoal:
        """Returns the goal: rest in the posture to hold, at any state and time."""
        return self._goal
