"""Constraints on single values, as annotations of fields of files and of arguments; each has a ``check``."""

import enum
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from affordance.exceptions import BadArgumentError, describe_choice, show_value

# Type of the errors that our own checks raise, with their problem as message.
OURS = "ours"

type StrPath = str | os.PathLike[str]


def complain(problem: str, at: str = "") -> PydanticCustomError:
    """Builds the error for a value that a check rejects.

    Args:
        problem: Value and bound, as ``is 3, must be at most 2``.
        at: Place below the value that was checked, as ``[1]`` or ``duration``; empty for the value itself.
    """
    return PydanticCustomError(OURS, "{problem}", {"problem": problem, "at": at})


@dataclass(frozen=True)
class Within:
    """Constraint on a number: finite, and from ``low`` to ``high``."""

    low: float = -math.inf
    high: float = math.inf

    def check(self, value: Any, at: str = "") -> float:
        """Returns the number if it is valid.

        Raises:
            PydanticCustomError: The value is not a number, or is out of bounds.
        """
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise complain(f"is {show_value(value)}, must be a number", at)
        if not self.low <= value <= self.high:  # before float(), which an integer of 400 digits would overflow
            low, high = (f"{bound:.12g}" for bound in (self.low, self.high))  # integers in full
            bounds = f"from {low} to {high}" if math.isfinite(self.high) else f"at least {low}"
            bounds = bounds if math.isfinite(self.low) else "finite"
            raise complain(f"is {show_value(value)}, must be {bounds}", at)
        try:
            number = float(value)
        except OverflowError as error:
            raise complain(f"is {show_value(value)}, must be finite", at) from error
        if not math.isfinite(number):
            raise complain(f"is {number}, must be finite", at)
        return number

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Builds a validator of numbers; neither texts nor booleans are accepted."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of a number, for editors."""
        bounds = {"minimum": self.low, "maximum": self.high}
        return {"type": "number"} | {name: value for name, value in bounds.items() if math.isfinite(value)}


@dataclass(frozen=True)
class Whole(Within):
    """Constraint on a number: whole, and from ``low`` to ``high``."""

    def check(self, value: Any, at: str = "") -> int:
        """Returns the number if it is valid.

        Raises:
            PydanticCustomError: The value is not a whole number, or is out of bounds.
        """
        number = super().check(value, at)
        if not number.is_integer():
            raise complain(f"is {number:g}, must be a whole number", at)
        return int(number)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of a whole number, for editors."""
        return super().__get_pydantic_json_schema__(schema, handler) | {"type": "integer"}


@dataclass(frozen=True)
class Vector:
    """Constraint on a list: ``size`` numbers, each within bounds."""

    size: int
    each: Within

    def check(self, value: Any, at: str = "") -> tuple[float, ...]:
        """Returns the numbers if they are valid.

        Raises:
            PydanticCustomError: The value is not such a list, or a number is out of bounds.
        """
        if not isinstance(value, list) or len(value) != self.size:
            raise complain(f"is {show_value(value)}, must be a list of {self.size} numbers", at)
        return tuple(self.each.check(entry, f"{at}[{i}]") for i, entry in enumerate(value))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Builds a validator of lists of numbers."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of a list of numbers, for editors."""
        entry = self.each.__get_pydantic_json_schema__(schema, handler)
        return {"type": "array", "items": entry, "minItems": self.size, "maxItems": self.size}


@dataclass(frozen=True)
class Text:
    """Constraint on a text: not empty, and at most ``longest`` characters."""

    longest: int = 20_000

    def check(self, value: Any) -> str:
        """Returns the text if it is valid.

        Raises:
            PydanticCustomError: The value is not a text, is empty, or is too long.
        """
        if not isinstance(value, str) or not value.strip():
            raise complain(f"is {show_value(value)}, must be a non-empty text")
        if len(value) > self.longest:
            raise complain(f"has {len(value)} letters, must have at most {self.longest}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Builds a validator of texts."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of a text, for editors."""
        return {"type": "string", "minLength": 1, "maxLength": self.longest}


@dataclass(frozen=True)
class OneOf:
    """Constraint on a text: the value of a member of an Enum."""

    kind: type[enum.Enum]

    def check(self, value: Any) -> enum.Enum:
        """Returns the member with that value.

        Raises:
            PydanticCustomError: No member has that value.
        """
        known = {str(member.value): member for member in self.kind}
        if isinstance(value, self.kind):
            return value
        if not isinstance(value, str) or value not in known:
            raise complain(describe_choice(value, known))
        return known[value]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Builds a validator of values of the Enum."""
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Builds the JSON schema of the Enum, for editors."""
        return {"enum": [member.value for member in self.kind]}


def run_check(name: str, check: Callable[[Any], Any], value: Any, unit: str = "", key: str = "") -> Any:
    """Runs the check of a constraint and raises its refusal as a BadArgumentError."""
    try:
        return check(value.item() if isinstance(value, np.generic) else value)
    except PydanticCustomError as error:
        context: Mapping[str, Any] = error.context or {}
        problem = f"{context['problem']} {unit}".strip()
        raise BadArgumentError(f"{name}{context['at']}", key, problem) from None


def check_path(name: str, value: Any) -> Path:
    """Checks that a value is a path, as text or as a path object.

    Raises:
        BadArgumentError: The value is not a path.
    """
    if not isinstance(value, str | os.PathLike) or not str(value):
        raise BadArgumentError(name, "", f"is {show_value(value)}, must be a path, as text or pathlib.Path")
    return Path(value)
