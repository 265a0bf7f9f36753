"""Files as pydantic models: each key is declared with its bounds, and every mistake gives a one-line error.

A model declares the keys of a mapping and their values; ``load_model`` reads a file into it. The first mistake
becomes a BadValueError that names file, key, value and bound, and the nearest valid name.
"""

import difflib
import enum
import math
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, ErrorDetails, PydanticCustomError, core_schema

from affordance.exceptions import BadValueError, describe_choice
from affordance.files.yaml_reader import read_yaml, show_value

# Type of the errors that our own checks raise, with their problem as message.
_OURS = "ours"


class DataModel(BaseModel):
    """Mapping in a file, with the keys of the class and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def complain(problem: str, at: str = "") -> PydanticCustomError:
    """Builds the error for a value that a check rejects.

    Args:
        problem: Value and bound, as ``is 3, must be at most 2``.
        at: Place below the value that was checked, as ``[1]`` or ``duration``; empty for the value itself.
    """
    return PydanticCustomError(_OURS, "{problem}", {"problem": problem, "at": at})


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


def load_model[M: BaseModel](path: Path, model: type[M], context: Mapping[str, Any] | None = None) -> M:
    """Reads a file into a model.

    Args:
        path: Path of the file.
        model: Model of its content.
        context: Further data that its checks need.

    Raises:
        BadValueError: The file or one of its values is invalid; the message says which and how.
    """
    return check_content(path, "", read_yaml(path), model, context)


def check_content[M: BaseModel](
    path: Path, key: str, content: Any, model: type[M], context: Mapping[str, Any] | None = None
) -> M:
    """Reads the content at a key of a file into a model; see ``load_model``."""
    try:
        return model.model_validate(content, context=dict(context or {}))
    except ValidationError as error:
        raise _translate(path, key, content, model, error) from error


def _translate(path: Path, key: str, content: Any, model: type[BaseModel], error: ValidationError) -> BadValueError:
    """Converts pydantic's first error to a BadValueError."""
    first, *_ = found = error.errors(include_url=False)
    place = list(first["loc"])
    at, problem = "", ""
    if first["type"] == _OURS:
        at, problem = first["ctx"]["at"], first["ctx"]["problem"]
        if place[-1:] == ["[key]"]:
            place, problem = place[:-2], f"has a name that {problem}"
    elif place[-1:] == ["[key]"]:  # a key of a mapping with arbitrary names
        problem = f"the key {show_value(place[-2])} must be a text"
        place = place[:-2]
    elif first["type"] == "missing":
        problem = "is missing" + _suggest(place, found)
    elif first["type"] in ("extra_forbidden", "invalid_key"):
        problem = _describe_unknown(str(place[-1]), list_keys(model, place[:-1]))
    else:
        problem = f"is {show_value(first['input'])}, {_describe_bound(first)}"
        if first["type"] == "too_short" and isinstance(first["input"], Mapping):
            problem = "is empty, must hold at least one entry"
    parts = [key, *place, *([at] if at else [])]
    return BadValueError(path, join_key(parts), problem)


def join_key(parts: Sequence[int | str]) -> str:
    """Formats a place in a file as ``tools[2].components``."""
    text = ""
    for part in parts:
        if isinstance(part, int):
            text += f"[{part}]"
        elif part:
            text += part if part.startswith("[") or not text else f".{part}"
    return text


def list_keys(model: type[BaseModel], place: Sequence[int | str]) -> list[str]:
    """Lists the keys that a mapping at a place of a model may have."""
    annotation: Any = model
    for part in place:
        annotation = _strip(annotation)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            if "root" in annotation.model_fields and part not in annotation.model_fields:
                annotation = _strip(annotation.model_fields["root"].annotation)
                annotation = typing.get_args(annotation)[-1]
                continue
            annotation = next(
                field.annotation for name, field in annotation.model_fields.items() if part in (name, field.alias)
            )
        else:  # entries of a list or of a mapping of names
            annotation = next(each for each in typing.get_args(annotation)[::-1] if each is not Ellipsis)
    annotation = _strip(annotation)
    return [field.alias or name for name, field in annotation.model_fields.items()]


def _strip(annotation: Any) -> Any:
    """Removes Optional and Annotated from an annotation."""
    while True:
        origin = typing.get_origin(annotation)
        if origin is typing.Annotated:
            annotation = typing.get_args(annotation)[0]
        elif origin in (types.UnionType, typing.Union):
            annotation = next(each for each in typing.get_args(annotation) if each is not types.NoneType)
        else:
            return annotation


def _suggest(place: Sequence[int | str], found: Sequence[ErrorDetails]) -> str:
    """Suggests an unknown key that may be a misspelling of a missing one."""
    others = [str(each["loc"][-1]) for each in found if each["type"] == "extra_forbidden"]
    near = difflib.get_close_matches(str(place[-1]), others, n=1)
    return f"; is {near[0]!r} misspelt?" if near else ""


def _describe_unknown(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return f"is not a key known here (known: {', '.join(known)}){hint}"


def _describe_bound(error: ErrorDetails) -> str:
    """Describes the bound of a value in the words of our own checks."""
    kind, context = error["type"], error.get("ctx", {})
    least = context.get("min_length", 1)
    bounds = {
        "model_type": "must be a mapping of keys to values",
        "dict_type": "must be a mapping of keys to values",
        "list_type": "must be a list with at least one entry",
        "tuple_type": "must be a list with at least one entry",
        "too_short": f"must be a list with at least {f'{least} entries' if least > 1 else 'one entry'}",
        "too_long": f"must have at most {context.get('max_length')} entries",
        "string_type": "must be a text",
        "bool_type": "must be true or false",
    }
    if kind in ("enum", "literal_error"):
        known = [each.strip(" '") for each in context["expected"].replace(" or ", ", ").split(",")]
        return describe_choice(error["input"], known).split(", ", 1)[1]
    return bounds.get(kind, f"must be otherwise: {error['msg']}")
