"""Start posture of a task: joint angles in the task's file, by the names of the joints."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.constraints import Within
from affordance.plant.arm import Arm

# Start posture: names and angles, [rad], of the joints that do not start in the home posture.
type Start = tuple[tuple[str, float], ...]


# Start posture in a file, left out where a task starts in the home posture.
type StartEntry = Annotated[
    dict[str, Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi)]],
    Field(description="Joints that do not start as in the home posture, and their angles, [rad]."),
]


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Rejects a start posture, the value of a key of a task's file, that the arm cannot take, by a BadValueError."""
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error
