"""Where a task starts: joint angles in its file, by the names of the joints."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.data_model import Within
from affordance.plant.arm import Arm

# Where a task's file says it starts: joints that are not as in the home posture, and their angles, [rad].
type Start = tuple[tuple[str, float], ...]


# The same in a file, left out where a task starts as the home posture.
type StartEntry = Annotated[
    dict[str, Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi)]],
    Field(description="Joints that do not start as in the home posture, and their angles, [rad]."),
]


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Rejects a start that an arm cannot take, as the value of a key of a task's file.

    Raises:
        BadValueError: There is no such joint, or it cannot take its angle; names the file and the joint's key.
    """
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error
