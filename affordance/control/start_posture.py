"""Start posture of a task: joint angles in the task file, by joint name."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.constraints import Within
from affordance.plant.arm import Arm

# Start posture: names and angles, [rad], of the joints that differ from the home posture.
type Start = tuple[tuple[str, float], ...]


# Start posture in a file; omitted if a task starts in the home posture.
type StartEntry = Annotated[
    dict[str, Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi)]],
    Field(description="Joints whose start angle differs from the home posture, and their angles, [rad]."),
]


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Raises a BadValueError if the arm cannot take a start posture from a task file.

    The message names the file, ``key``, and the joint.
    """
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error
