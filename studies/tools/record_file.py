"""Reads the force-torque records and results of the workshop tools' authors, which are Python pickles.

A pickle may name any function to be called. Here it may name seven, none of which does more than hold numbers; a
pickle that names any other is refused.
"""

import io
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files.bounded import RECORDING, read_bytes

# Largest accepted size of an authors' file, ten times that of other recordings; it bounds the memory used.
_MOST_BYTES = 10 * RECORDING


class Recording(NamedTuple):
    """Record of a force-torque sensor S while a robot moved a tool, at N times."""

    X_WS: Array  # pose of the sensor, shape (N, 4, 4)
    X_WF: Array  # pose of the tool's mesh frame, shape (N, 4, 4)
    w_WS: Array  # angular velocity of the sensor, shape (N, 3), [rad/s]
    a_WS: Array  # linear acceleration of the sensor's origin, shape (N, 3), [m/s^2]
    alpha_WS: Array  # angular acceleration of the sensor, shape (N, 3), [rad/s^2]
    force_W: Array  # measured force, shape (N, 3), [N]
    torque_W: Array  # measured torque about So, shape (N, 3), [N m]


class _Held:
    """Substitute for any class of the authors: stores its arguments, and has no methods."""

    def __init__(self, *arguments: object) -> None:
        self.arguments = arguments


def _make_array(buffer: Any, dtype: Any, shape: Any, order: str) -> Array:
    array: Array = np.frombuffer(buffer, dtype=dtype).reshape(shape, order="F" if order == "F" else "C")
    return array


def _make_scalar(dtype: Any, buffer: bytes) -> float:
    return float(np.frombuffer(buffer, dtype=dtype)[0])


_ALLOWED: Mapping[tuple[str, str], Callable[..., object]] = {
    ("numpy", "dtype"): np.dtype,
    ("numpy.core.numeric", "_frombuffer"): _make_array,
    ("numpy.core.multiarray", "scalar"): _make_scalar,
    ("KinoDynamicLoader", "Record"): _Held,
    ("spatialmath.pose3d", "SE3"): _Held,
    ("spatialmath.spatialvector", "SpatialVelocity"): _Held,
    ("spatialmath.spatialvector", "SpatialForce"): _Held,
}


class _Unpickler(pickle.Unpickler):
    def find_class(self, module_name: str, global_name: str) -> Any:
        if (module_name, global_name) not in _ALLOWED:
            raise pickle.UnpicklingError(f"it names {module_name}.{global_name}, which no record contains")
        return _ALLOWED[module_name, global_name]


def read_pickle(path: Path) -> Any:
    """Reads a pickle that may only hold records, arrays, numbers and strings.

    Raises:
        BadValueError: The file cannot be read, or names anything else.
    """
    try:
        return _Unpickler(io.BytesIO(read_bytes(path, _MOST_BYTES))).load()
    except (BadValueError, MemoryError):
        raise
    except Exception as error:  # because a damaged pickle can raise anything
        raise BadValueError(path, "", f"is not a readable record: {error}") from error


def read_recording(path: Path) -> Recording:
    """Reads the record of one tool.

    Raises:
        BadValueError: The file cannot be read, or is no such record.
    """
    rows = read_pickle(path)
    try:
        poses = [np.array([_take(row, name).data[0] for row in rows]) for name in ("ft_pose", "object_pose")]
        velocity, force = (
            np.array([np.ravel(_take(row, name).data[0]) for row in rows]) for name in ("ft_vel", "ft_value")
        )
        acceleration = np.array([np.ravel(_take(row, "ft_acc")) for row in rows])
    except (AttributeError, TypeError, IndexError, ValueError) as error:
        raise BadValueError(path, "", f"is not a record of forces and torques: {error}") from error
    wrong = velocity.shape[1:] != (6,) or force.shape[1:] != (6,) or acceleration.shape[1:] != (6,)
    if wrong or any(pose.shape[1:] != (4, 4) for pose in poses):
        raise BadValueError(path, "", "is not a record of poses, velocities, accelerations and wrenches")
    (a_WS, alpha_WS), (force_W, torque_W) = np.hsplit(acceleration, 2), np.hsplit(force, 2)
    return Recording(poses[0], poses[1], velocity[:, 3:], a_WS, alpha_WS, force_W, torque_W)


def _take(row: Any, name: str) -> Any:
    value = row.__dict__[name] if name in getattr(row, "__dict__", {}) else None
    if value is None:
        raise ValueError(f"a row has no {name}")
    return value
