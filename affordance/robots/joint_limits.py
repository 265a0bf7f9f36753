"""Limits of acceleration and velocity from a file ``joint_limits.yaml``, as MoveIt and ros2_control have it."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import ConfigDict, Field

from affordance.exceptions import BadValueError
from affordance.files.constraints import Within
from affordance.files.data_model import DataModel, load_model
from affordance.plant.serial_chain import SerialChain

_MOST = 1e4  # of a velocity, [rad/s], and an acceleration, [rad/s^2]


class _JointEntry(DataModel):
    """Limits of a joint; those that are switched off do not count, and others concern nothing here."""

    model_config = ConfigDict(extra="ignore")

    has_velocity_limits: bool = True
    max_velocity: Annotated[float, Within(0.0, _MOST)] | None = None
    has_acceleration_limits: bool = True
    max_acceleration: Annotated[float, Within(0.0, _MOST)] | None = None


class _LimitsEntry(DataModel):
    """File of limits, by joint."""

    model_config = ConfigDict(extra="ignore")

    joint_limits: Annotated[dict[str, _JointEntry], Field(min_length=1)]


def limit_joints(robot: SerialChain, path: Path) -> SerialChain:
    """Returns the arm with the limits of a file where these are lower than its own.

    A joint of the file that the arm lacks, such as a finger, is left out. A file that is invalid, names none of the
    arm's joints, or limits one to 0, raises a BadValueError.
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
