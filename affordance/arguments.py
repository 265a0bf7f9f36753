"""Checks of what public functions and constructors are given, in the words of the command line.

Every check returns the value as the program wants it (a text becomes a path, the text of a choice the choice) or
raises a BadArgumentError that names argument, value and bound. Fields of a dataclass say their bounds as annotations,
``Annotated[float, Within(0.0, 1.0)]``, and ``check_fields`` checks all of them.
"""

import dataclasses
import enum
import math
import os
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic_core import PydanticCustomError

from affordance.arrays import Array
from affordance.exceptions import BadArgumentError, describe_choice
from affordance.files.data_model import OneOf, Whole, Within, complain
from affordance.files.yaml_reader import show_value

type StrPath = str | os.PathLike[str]
type Seed = int | tuple[int, ...]

# Largest whole number that a seed may hold.
SEED_MAX = 2**32 - 1
# Bounds of numbers that commands and functions share: a longer run than anyone has patience for is a slip.
REPEATS = Whole(1, 1_000_000)
JOBS = Whole(1, 4096)
_SEED = Whole(0, SEED_MAX)
# Largest error of the entries of a rotation matrix that is only rounded, 1.
_ROTATION_TOLERANCE = 1e-6


@dataclasses.dataclass(frozen=True)
class Setting:
    """Unit of a setting and source of its value, as an annotation of a field.

    Attributes:
        unit: Unit, "1" for none; empty for what is no number.
        source: Source of the default value, or reason for it.
    """

    unit: str = ""
    source: str = ""


@dataclasses.dataclass(frozen=True)
class Among:
    """Says of a text, as an annotation of a field, that it is one of some names.

    Attributes:
        names: Names that are known.
    """

    names: tuple[str, ...]

    def check(self, value: Any) -> str:
        """Returns the name.

        Raises:
            PydanticCustomError: It is not known.
        """
        if not isinstance(value, str) or value not in self.names:
            raise complain(describe_choice(value, self.names))
        return value


def check_number(name: str, value: Any, low: float = -math.inf, high: float = math.inf, unit: str = "") -> float:
    """Checks that a value is a finite number within bounds.

    Args:
        name: Name of the argument.
        value: Value that was given.
        low: Least number that is allowed.
        high: Largest number that is allowed.
        unit: Unit of the number, for the message.

    Raises:
        BadArgumentError: The value is no such number.
    """
    return float(_run(name, Within(low, high).check, value, unit))


def check_whole(name: str, value: Any, bound: Whole) -> int:
    """Checks that a value is a whole number within bounds.

    Raises:
        BadArgumentError: The value is no such number.
    """
    return int(_run(name, bound.check, value))


def check_seed(value: Any, name: str = "seed") -> tuple[int, ...]:
    """Checks a seed: a whole number, or several of them where draws of different kinds must differ.

    Raises:
        BadArgumentError: The value is no seed.
    """
    if isinstance(value, tuple | list) and value:
        return tuple(check_whole(f"{name}[{i}]", each, _SEED) for i, each in enumerate(value))
    if isinstance(value, tuple | list):
        raise BadArgumentError(name, "", "is empty, must be a whole number, or several")
    return (check_whole(name, value, _SEED),)


def check_path(name: str, value: Any) -> Path:
    """Checks that a value is a path, as text or as an object that stands for one.

    Raises:
        BadArgumentError: The value is no path.
    """
    if not isinstance(value, str | os.PathLike) or not str(value):
        raise BadArgumentError(name, "", f"is {show_value(value)}, must be a path, as text or pathlib.Path")
    return Path(value)


def check_kind[T](name: str, value: Any, kind: type[T], hint: str = "") -> T:
    """Checks that a value is of a class.

    Args:
        name: Name of the argument.
        value: Value that was given.
        kind: Class that it must be of; a Protocol must be checkable at run time.
        hint: Way to get such an object.

    Raises:
        BadArgumentError: The value is of another class.
    """
    if not isinstance(value, kind):
        given = f"is a {type(value).__name__}, must be a {kind.__name__}"
        raise BadArgumentError(name, "", f"{given}; {hint}" if hint else given)
    return value


def check_member[E: enum.Enum](name: str, value: Any, kind: type[E]) -> E:
    """Checks that a value is a member of an Enum, or the text of one.

    Raises:
        BadArgumentError: There is no such member.
    """
    found: E = _run(name, OneOf(kind).check, value)
    return found


def check_fractions(name: str, values: Any) -> Array:
    """Checks numbers from 0 to 1, shape (n,).

    Raises:
        BadArgumentError: A number is not from 0 to 1; percents are named as such.
    """
    fractions = check_array(name, values, (None,))
    for i, value in enumerate(fractions):
        if not 0.0 <= value <= 1.0:
            percent = f"; {value:g} % is {value / 100.0:g}" if 1.0 < value <= 100.0 else ""
            raise BadArgumentError(f"{name}[{i}]", "", f"is {value:g}, must be from 0 to 1{percent}")
    return fractions


def check_array(name: str, values: Any, shape: Sequence[int | None]) -> Array:
    """Checks an array of finite numbers, and returns it as floating-point numbers.

    Args:
        name: Name of the argument.
        values: Array, or lists of numbers.
        shape: Shape that it must have; None for any length.

    Raises:
        BadArgumentError: The array is of another shape, or a number is not finite.
    """
    wanted = f"({', '.join('n' if size is None else str(size) for size in shape)}{',' if len(shape) == 1 else ''})"
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise BadArgumentError(name, "", f"is {show_value(values)}, must be numbers of shape {wanted}") from error
    fits = array.ndim == len(shape) and all(b in (None, a) for a, b in zip(array.shape, shape, strict=True))
    if not fits:
        raise BadArgumentError(name, "", f"has the shape {array.shape}, must have {wanted}")
    if not np.isfinite(array).all():
        place = tuple(int(each) for each in np.argwhere(~np.isfinite(array))[0])
        where = "".join(f"[{each}]" for each in place)
        raise BadArgumentError(f"{name}{where}", "", f"is {array[place]}, must be finite")
    return array


def check_pose(name: str, X: ArrayLike) -> Array:
    """Checks a pose, shape (4, 4), and returns a read-only copy: a rotation and a translation, nothing else.

    Raises:
        BadArgumentError: The matrix scales, shears or mirrors, or its last row is not (0, 0, 0, 1).
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


def check_fields(instance: Any) -> None:
    """Checks all fields of a dataclass by their annotations, and puts in what their checks return.

    Known are ``Within``, ``Whole`` and ``Among`` as annotations, members of an Enum (their texts too), paths, truth
    values, and instances of a class; None where a field may be None.

    Raises:
        BadArgumentError: A field is not as it must be.
    """
    kind: Any = type(instance)
    for name, hint in list_field_types(kind).items():
        value = getattr(instance, name)
        checked = _check_field(hint, kind.__name__, name, value)
        if checked is not value:
            object.__setattr__(instance, name, checked)


@lru_cache(maxsize=64)
def list_field_types(kind: Any) -> Mapping[str, Any]:
    """Types of the fields of a dataclass, a class, with their annotations, by name."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _check_field(hint: Any, owner: str, name: str, value: Any) -> Any:
    hint = getattr(hint, "__value__", hint)  # what a ``type`` statement names
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        if value is None:
            return None
        (hint,) = (each for each in typing.get_args(hint) if each is not types.NoneType)
        return _check_field(hint, owner, name, value)
    if typing.get_origin(hint) is typing.Annotated:
        hint, *notes = typing.get_args(hint)
        checks = [note.check for note in notes if hasattr(note, "check")]
        return _run(owner, checks[0], value, key=name) if checks else _check_field(hint, owner, name, value)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return _run(owner, OneOf(hint).check, value, key=name)
    if hint is Path:
        try:
            return check_path(name, value)
        except BadArgumentError as error:
            raise BadArgumentError(owner, name, error.problem) from error
    if isinstance(hint, type) and not isinstance(value, hint):
        wanted = "true or false" if hint is bool else f"a {hint.__name__}"
        raise BadArgumentError(owner, name, f"is {show_value(value)}, must be {wanted}")
    return value


def _run(name: str, check: Callable[[Any], Any], value: Any, unit: str = "", key: str = "") -> Any:
    """Runs a check of ``files.data_model`` and says what it refuses of an argument."""
    try:
        return check(value.item() if isinstance(value, np.generic) else value)
    except PydanticCustomError as error:
        context: Mapping[str, Any] = error.context or {}
        problem = f"{context['problem']} {unit}".strip()
        raise BadArgumentError(f"{name}{context['at']}", key, problem) from None
