"""Constraints on single values in files and arguments, used as type annotations.

For example, a dataclass field has the type ``Annotated[float, Within(0.0, 1.0)]``. When an object is created,
``check_fields`` calls the ``check`` of each annotated constraint. A ``Setting`` in the same annotation adds unit and
source.
"""

import enum
import math
import os
import re
import types
import typing
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, override

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from affordance.exceptions import BadArgumentError, BadValueError, describe_choice, find_hidden, show_value

OURS = "ours"  # type of the pydantic errors that these checks raise
# Portable file names of POSIX (3.282, Portable Filename Character Set), short enough that a suffix can be added.
_FILE_NAME = re.compile("[A-Za-z0-9][A-Za-z0-9_.-]{0,79}")
# Names of devices on Windows, which are reserved even with a suffix (Naming Files, Paths, and Namespaces, Microsoft).
_RESERVED = {"con", "prn", "aux", "nul", *(f"{kind}{digit}" for kind in ("com", "lpt") for digit in range(10))}

type StrPath = str | os.PathLike[str]


def complain(problem: str, at: str = "") -> PydanticCustomError:
    """Creates the error for a rejected value.

    Args:
        problem: Description of the value and its bound, such as ``is 3, must be at most 2``.
        at: Place within the value, such as ``[1]``.
    """
    return PydanticCustomError(OURS, "{problem}", {"problem": problem, "at": at})


class Constraint(ABC):
    """Constraint on a value. It annotates a field of a pydantic model or a dataclass."""

    @abstractmethod
    def describe(self) -> JsonSchemaValue:
        """Returns a JSON schema of valid values, for editors."""

    @abstractmethod
    def check(self, value: Any) -> Any:
        """Checks a value, and converts it to the form that the program uses.

        Raises:
            PydanticCustomError: The value is invalid.
        """

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return self.describe()


@dataclass(frozen=True)
class Within(Constraint):
    """Constraint on a number, which must be finite and from ``low`` to ``high``. Texts and Booleans are rejected."""

    low: float = -math.inf
    high: float = math.inf

    @override
    def describe(self) -> JsonSchemaValue:
        bounds = {"minimum": self.low, "maximum": self.high}
        return {"type": "number"} | {name: value for name, value in bounds.items() if math.isfinite(value)}

    @override
    def check(self, value: Any, at: str = "") -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise complain(f"is {show_value(value)}, must be a number", at)
        if not self.low <= value <= self.high:  # checked first, because float() overflows for integers of 400 digits
            low, high = (f"{bound:.12g}" for bound in (self.low, self.high))  # without an exponent for integers
            bounds = f"from {low} to {high}" if math.isfinite(self.high) else f"at least {low}"
            bounds = bounds if math.isfinite(self.low) else "finite"
            raise complain(f"is {show_value(value)}, must be {bounds}{self._suggest(value)}", at)
        try:
            number = float(value)
        except OverflowError as error:
            raise complain(f"is {show_value(value)}, must be finite", at) from error
        if not math.isfinite(number):
            raise complain(f"is {number}, must be finite", at)
        return number

    def _suggest(self, value: float) -> str:
        """Suggests a valid value that the user probably meant; empty if there is none."""
        return ""


@dataclass(frozen=True)
class Length(Within):
    """Constraint on a length, [m]. The error suggests a conversion if the value fits in mm."""

    @override
    def _suggest(self, value: float) -> str:
        metres = 1e-3 * max(-1e9, min(value, 1e9))  # limited, because integers of 400 digits overflow
        return f"; {metres:g} if mm were meant" if self.low <= metres <= self.high else ""


@dataclass(frozen=True)
class Whole(Within):
    """Constraint on a whole number, which must be from ``low`` to ``high``."""

    @override
    def describe(self) -> JsonSchemaValue:
        return super().describe() | {"type": "integer"}

    @override
    def check(self, value: Any, at: str = "") -> int:
        number = super().check(value, at)
        if not number.is_integer():
            raise complain(f"is {number:g}, must be a whole number", at)
        return int(number)

    @override
    def _suggest(self, value: float) -> str:
        nearest = self.low if value < self.low else self.high
        return "" if value != value else f"; the nearest is {nearest:.12g}"


SEEDS = Whole(0, 2**32 - 1)  # range of NumPy's seeds


@dataclass(frozen=True)
class Vector(Constraint):
    """Constraint on a list of ``size`` numbers, each within bounds."""

    size: int
    each: Within

    @override
    def describe(self) -> JsonSchemaValue:
        return {"type": "array", "items": self.each.describe(), "minItems": self.size, "maxItems": self.size}

    @override
    def check(self, value: Any, at: str = "") -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != self.size:
            raise complain(f"is {show_value(value)}, must be a list of {self.size} numbers", at)
        return tuple(self.each.check(entry, f"{at}[{i}]") for i, entry in enumerate(value))


@dataclass(frozen=True)
class Text(Constraint):
    """Constraint on a text, which must not be empty and have at most ``longest`` characters."""

    longest: int = 20_000

    @override
    def describe(self) -> JsonSchemaValue:
        return {"type": "string", "minLength": 1, "maxLength": self.longest}

    @override
    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not value.strip():
            raise complain(f"is {show_value(value)}, must be a non-empty text")
        if len(value) > self.longest:
            raise complain(f"has {len(value)} characters, must have at most {self.longest}")
        return value


@dataclass(frozen=True)
class OneLine(Text):
    """Constraint on a text, which must be a single line of visible characters."""

    longest: int = 200

    @override
    def check(self, value: Any) -> str:
        text: str = super().check(value)
        if hidden := find_hidden(text):
            raise complain(f"is {show_value(value)}, must be without {hidden}")
        return text


# Name of an object, material, grip, joint, link or column in a file. Names are used in tables, labels and trajectory
# files, where the longest name determines the space that all names take.
type Name = Annotated[str, OneLine()]


@dataclass(frozen=True)
class FileName(Text):
    """Constraint on a text, which must be a portable file name without folders."""

    @override
    def describe(self) -> JsonSchemaValue:
        return {"type": "string", "pattern": f"^{_FILE_NAME.pattern}$"}

    @override
    def check(self, value: Any) -> str:
        text: str = super().check(value)
        if not _FILE_NAME.fullmatch(text) or text.split(".")[0].lower() in _RESERVED:
            raise complain(
                f"is {show_value(value)}, must be the name of a file: letters, digits, '_', '-' and '.', at most 80, "
                "beginning with a letter or digit, and not reserved by Windows"
            )
        return text


@dataclass(frozen=True)
class OneOf(Constraint):
    """Constraint on a text, which must be one of several names, or the value of an Enum member.

    The value of an Enum member is converted to the member.
    """

    kind: type[enum.Enum] | tuple[str, ...]

    @property
    def _known(self) -> Mapping[str, Any]:
        return {str(getattr(each, "value", each)): each for each in self.kind}

    @override
    def describe(self) -> JsonSchemaValue:
        return {"enum": list(self._known)}

    @override
    def check(self, value: Any) -> Any:
        if isinstance(self.kind, type) and isinstance(value, self.kind):
            return value
        if not isinstance(value, str) or value not in self._known:
            raise complain(describe_choice(value, self._known))
        return self._known[value]


def run_check(name: str, check: Callable[[Any], Any], value: Any, unit: str = "", key: str = "") -> Any:
    """Runs a constraint's check, and converts its error to a BadArgumentError."""
    try:
        return check(value.item() if isinstance(value, np.generic) else value)
    except PydanticCustomError as error:
        context: Mapping[str, Any] = error.context or {}
        raise BadArgumentError(f"{name}{context['at']}", key, f"{context['problem']} {unit}".strip()) from None


def check_names(path: Path, key: str, names: Iterable[str]) -> None:
    """Checks that names in a file are valid. Empty names are allowed.

    Raises:
        BadValueError: A name is invalid.
    """
    for name in filter(None, names):
        try:
            run_check("", OneLine().check, name)
        except BadArgumentError as error:
            raise BadValueError(path, key, error.problem) from error


def check_path(name: str, value: Any) -> Path:
    """Converts a text or path object to a path.

    Raises:
        BadArgumentError: The value is neither a text nor a path object.
    """
    if not isinstance(value, str | os.PathLike) or not str(value):
        raise BadArgumentError(name, "", f"is {show_value(value)}, must be a path, as text or pathlib.Path")
    return Path(value)


@dataclass(frozen=True)
class Setting:
    """Annotation with a setting's unit ("1" if dimensionless) and the source of its default value."""

    unit: str = ""
    source: str = ""


@dataclass(frozen=True)
class Checked:
    """Annotation with a function that checks a value, given the argument's name, and returns it."""

    function: Callable[[str, Any], Any]


def check_fields(instance: Any) -> None:
    """Checks all fields of a dataclass by their annotations, and stores the checked values.

    A field can have an annotated check (``Within``, ``Whole``, ``OneOf``, ``Checked``). It can also be a member of an
    Enum or its text, a path, a Boolean, an instance of a class, or None if the type allows it.

    Raises:
        BadArgumentError: A field is invalid.
    """
    kind: Any = type(instance)
    for name, hint in list_field_types(kind).items():
        value = getattr(instance, name)
        checked = _check_field(hint, kind.__name__, name, value)
        if checked is not value:
            object.__setattr__(instance, name, checked)


class CheckedFields:
    """Base class of dataclasses that check their fields when created.

    Raises:
        BadArgumentError: A field is invalid.
    """

    __post_init__ = check_fields


@lru_cache(maxsize=64)
def list_field_types(kind: Any) -> Mapping[str, Any]:
    """Returns the types of a dataclass's fields by name, including annotations."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in fields(kind)}


def _check_field(hint: Any, owner: str, name: str, value: Any) -> Any:
    hint = getattr(hint, "__value__", hint)  # the value of a ``type`` statement
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        if value is None:
            return None
        (hint,) = (each for each in typing.get_args(hint) if each is not types.NoneType)
        return _check_field(hint, owner, name, value)
    if hint is Path:
        hint = Annotated[Path, Checked(check_path)]
    if typing.get_origin(hint) is typing.Annotated:
        hint, *notes = typing.get_args(hint)
        for note in notes:
            if isinstance(note, Checked):
                try:
                    return note.function(name, value)
                except BadArgumentError as error:
                    raise BadArgumentError(owner, str(error.source), error.problem) from None
        checks = [note.check for note in notes if hasattr(note, "check")]
        return run_check(owner, checks[0], value, key=name) if checks else _check_field(hint, owner, name, value)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return run_check(owner, OneOf(hint).check, value, key=name)
    if isinstance(hint, type) and not isinstance(value, hint):
        wanted = "true or false" if hint is bool else f"a {hint.__name__}"
        raise BadArgumentError(owner, name, f"is {show_value(value)}, must be {wanted}")
    return value
