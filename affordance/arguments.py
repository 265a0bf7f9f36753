"""Checks arguments of public functions and constructors, with the same messages as the command line.

Every check returns the value in the form that the program uses; for example, a text is converted to a path or an Enum
member. An invalid value raises a BadArgumentError that names argument, value and bound.
"""

import enum
import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from affordance.arrays import Array
from affordance.exceptions import BadArgumentError, show_value
from affordance.files.constraints import SEEDS, OneOf, Whole, Within, run_check

type Seed = int | tuple[int, ...]

# Bounds for both commands and functions, which limit time and memory (SECURITY.md).
REPEATS = Whole(1, 100_000)
JOBS = Whole(1, max(16, 4 * (os.cpu_count() or 1)))  # a process takes 0.4 GB
# Largest rounding error of the entries of a rotation matrix, [1].
_ROTATION_TOLERANCE = 1e-6
# Largest difference between equal entries due to rounding, relative to the largest entry, [1].
_SYMMETRY = 1e-6


def check_number(name: str, value: Any, low: float = -math.inf, high: float = math.inf, unit: str = "") -> float:
    """Checks that a value is a finite number within bounds."""
    return float(run_check(name, Within(low, high).check, value, unit))


def check_whole(name: str, value: Any, bound: Whole) -> int:
    """Checks that a value is a whole number within bounds."""
    return int(run_check(name, bound.check, value))


def check_seed(value: Any) -> tuple[int, ...]:
    """Checks a seed: one whole number, or several numbers to separate draws for different purposes."""
    if isinstance(value, tuple | list) and value:
        return tuple(check_whole(f"seed[{i}]", each, SEEDS) for i, each in enumerate(value))
    if isinstance(value, tuple | list):
        raise BadArgumentError("seed", "", "is empty, must be a whole number, or several")
    return (check_whole("seed", value, SEEDS),)


def check_kind[T](name: str, value: T, kind: Any, hint: str = "") -> T:
    """Checks that a value is an instance of a class, or of a ``runtime_checkable`` Protocol.

    ``hint`` tells users how to create such an instance.
    """
    if not isinstance(value, kind):
        given = f"is of type {type(value).__name__}, must be of type {kind.__name__}"
        raise BadArgumentError(name, "", f"{given}; {hint}" if hint else given)
    return value


def check_member[E: enum.Enum](name: str, value: Any, kind: type[E]) -> E:
    """Checks that a value is a member of an Enum, or the text of a member."""
    found: E = run_check(name, OneOf(kind).check, value)
    return found


def check_fractions(name: str, values: Any) -> Array:
    """Checks that numbers, (n,), are from 0 to 1. The error converts percentages."""
    fractions = check_array(name, values, (None,))
    for i, value in enumerate(fractions):
        if not 0.0 <= value <= 1.0:
            percent = f"; {value:g} % is {value / 100.0:g}" if 1.0 < value <= 100.0 else ""
            raise BadArgumentError(f"{name}[{i}]", "", f"is {value:g}, must be from 0 to 1{percent}")
    return fractions


def check_array(name: str, values: Any, shape: Sequence[int | None]) -> Array:
    """Checks shape and finiteness of an array, and converts it to floats. None in the shape allows any length."""
    array = read_numbers(name, values, f" of shape {_show_shape(shape)}")
    if array.ndim != len(shape) or any(b not in (None, a) for a, b in zip(array.shape, shape, strict=True)):
        raise BadArgumentError(name, "", f"has the shape {array.shape}, must have {_show_shape(shape)}")
    if not np.isfinite(array).all():
        place = tuple(int(each) for each in np.argwhere(~np.isfinite(array))[0])
        where = "".join(f"[{each}]" for each in place)
        raise BadArgumentError(f"{name}{where}", "", f"is {array[place]}, must be finite")
    return array


def read_numbers(name: str, values: Any, form: str = "") -> Array:
    """Converts numbers of any shape to an array, which may contain infinite values or NaN."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise BadArgumentError(name, "", f"is {show_value(values)}, must be numbers{form}") from error


def check_symmetry(name: str, matrix: Array) -> None:
    """Checks that a square matrix is symmetric up to rounding."""
    if (matrix != matrix.T).any() and np.abs(matrix - matrix.T).max() > _SYMMETRY * np.abs(matrix).max():
        raise BadArgumentError(name, "", "is not symmetric, must be symmetric")


def check_colour(name: str, values: Any) -> tuple[float, float, float]:
    """Checks a colour: red, green and blue from 0 to 1."""
    if isinstance(values, str):
        raise BadArgumentError(name, "", f"is {show_value(values)}, must be red, green and blue from 0 to 1")
    red, green, blue = (float(value) for value in check_array(name, values, (3,)))
    for i, value in enumerate((red, green, blue)):
        if not 0.0 <= value <= 1.0:
            byte = f"; {value:g} of 255 is {value / 255.0:.3g}" if 1.0 < value <= 255.0 else ""
            raise BadArgumentError(f"{name}[{i}]", "", f"is {value:g}, must be from 0 to 1{byte}")
    return red, green, blue


def check_pose(name: str, X: ArrayLike) -> Array:
    """Checks that a pose, (4, 4), is a rigid transform, and returns a read-only copy.

    The matrix must not scale, shear or mirror, and its last row must be (0, 0, 0, 1).
    """
    pose = check_array(name, X, (4, 4)).copy()
    R = pose[:3, :3]
    if np.abs(pose[3] - (0.0, 0.0, 0.0, 1.0)).max() > _ROTATION_TOLERANCE:
        raise BadArgumentError(name, "", f"has the last row {show_value(pose[3].tolist())}, must be [0, 0, 0, 1]")
    if np.abs(R.T @ R - np.eye(3)).max() > _ROTATION_TOLERANCE:
        lengths = ", ".join(f"{length:g}" for length in np.linalg.norm(R, axis=0))
        problem = f"has axes of the lengths {lengths}, must be a rotation: axes of length 1 at right angles"
        raise BadArgumentError(name, "", problem)
    if np.linalg.det(R) < 0.0:
        raise BadArgumentError(name, "", "is a reflection, must be a rotation: its determinant must be 1")
    pose.setflags(write=False)
    return pose


def _show_shape(shape: Sequence[int | None]) -> str:
    sizes = ["n" if size is None else str(size) for size in shape]
    return f"({', '.join(sizes)}{',' if len(sizes) == 1 else ''})"
