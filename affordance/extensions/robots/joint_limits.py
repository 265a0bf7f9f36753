"""Reads acceleration and velocity limits from a ``joint_limits.yaml`` of MoveIt or ros2_control."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import ConfigDict, Field

from affordance.exceptions import BadValueError
from affordance.files.constraints import Within
from affordance.files.data_model import DataModel, load_model
from affordance.plant.serial_chain import SerialChain

_MOST = 1e4  # largest velocity, [rad/s], and acceleration, [rad/s^2]


class _JointEntry(DataModel):
    """Limits of a joint; limits that are switched off do not apply, and other keys are ignored."""

    model_config = ConfigDict(extra="ignore")

    has_velocity_limits: bool = True
    max_velocity: Annotated[float, Within(0.0, _MOST)] | None = None
    has_acceleration_limits: bool = True
    max_acceleration: Annotated[float, Within(0.0, _MOST)] | None = None


class _LimitsEntry(DataModel):
    """Contents of the file: limits by joint."""

    model_config = ConfigDict(extra="ignore")

    joint_limits: Annotated[dict[str, _JointEntry], Field(min_length=1)]


def limit_joints(robot: SerialChain, path: Path) -> SerialChain:
    """Returns the arm with those limits of a file that are lower than its own.

    Joints that the arm lacks, such as a finger, are ignored. A file that is invalid, names none of the arm's joints,
    or limits one of them to 0 raises a BadValueError.
    """
    entries = load_model(path, _LimitsEntry).joint_limits
    if not set(entries) & set(robot.joint_names):
        problem = f"names none of the joints {', '.join(robot.joint_names)}"
        raise BadValueError(path, "joint_limits", problem)
    speeds, accelerations = robot.velocity_limits.copy(), robot.acceleration_limits.copy()
    for j, name in enumerate(robot.joint_names):
        entry = entries.get(name, _JointEntry())
        for values, key, is_on, limit in (
            (speeds, "max_velocity", entry.has_velocity_limits, entry.max_velocity),
            (accelerations, "max_acceleration", entry.has_acceleration_limits, entry.max_acceleration),
        ):
            if not is_on or limit is None:
                continue
            if not limit > 0.0:
                raise BadValueError(path, f"joint_limits.{name}.{key}", f"is {limit:g}, must be more than 0")
            values[j] = np.minimum(values[j], limit)
    return replace(robot, velocity_limits=speeds, acceleration_limits=accelerations)
