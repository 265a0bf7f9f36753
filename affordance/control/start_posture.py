"""Where a task starts: joint angles in its file, by the names of the joints."""

import math
from pathlib import Path

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.yaml_reader import Record
from affordance.plant.arm import Arm

# Where a task's file says it starts: joints that are not as in the home posture, and their angles, [rad].
type Start = tuple[tuple[str, float], ...]


def read_start(record: Record) -> Start:
    """Takes the optional mapping ``start`` of a task's file.

    Raises:
        BadValueError: It is not a mapping of names to angles of a turn at most.
    """
    if not record.has("start"):
        return ()
    return tuple(record.record("start").numbers(low=-2.0 * math.pi, high=2.0 * math.pi).items())


def check_start(path: Path, key: str, start: Start, arm: Arm) -> None:
    """Refuses a start that an arm cannot take, as the value of a key of a task's file.

    Raises:
        BadValueError: There is no such joint, or it cannot take its angle; names the file and the joint's key.
    """
    for name, angle in start:
        try:
            arm.find_posture({name: angle})
        except AffordanceError as error:
            raise BadValueError(path, f"{key}.{name}", str(error)) from error
