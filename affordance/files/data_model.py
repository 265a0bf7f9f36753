"""Pydantic models of files, with bounds for each key and one-line error messages.

A model declares keys and their values, and ``load_model`` reads a file into it. The first fault raises a
BadValueError that names file, key, value and bound, and suggests the most similar valid name.
"""

import difflib
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from affordance.exceptions import BadValueError, describe_choice, show_value, suggest
from affordance.files.bounded import read_yaml
from affordance.files.constraints import OURS


class DataModel(BaseModel):
    """Mapping in a file. Only declared keys are allowed."""

    # Keys that users often write here by mistake, each with a hint about the correct place.
    elsewhere: ClassVar[Mapping[str, str]] = {}

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


def load_model[M: BaseModel](path: Path, model: type[M]) -> M:
    """Reads a YAML file into a model.

    Raises:
        BadValueError: The file is invalid; only the first fault is reported.
    """
    return check_content(path, "", read_yaml(path), model)


def check_content[M: BaseModel](path: Path, key: str, content: Any, model: type[M]) -> M:
    """Converts the content at a key of a file to a model. Errors are the same as in ``load_model``."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise _translate(path, key, model, error) from error


def _translate(path: Path, key: str, model: type[BaseModel], error: ValidationError) -> BadValueError:
    """Converts pydantic's first error to a BadValueError."""
    first, *_ = found = error.errors(include_url=False)
    place = list(first["loc"])
    at, problem = "", ""
    if first["type"] == OURS:
        at, problem = first["ctx"]["at"], first["ctx"]["problem"]
        if place[-1:] == ["[key]"]:
            place, problem = place[:-2], f"has a name that {problem}"
    elif place[-1:] == ["[key]"]:  # a key of a mapping with arbitrary names
        problem = f"the key {show_value(place[-2])} must be a text"
        place = place[:-2]
    elif first["type"] == "missing":
        problem = "is missing" + _suggest(place, found)
    elif first["type"] in ("extra_forbidden", "invalid_key"):
        problem = _describe_unknown(_find_model(model, place[:-1]), place[-1])
    else:
        # A whole file's contents are not quoted, because the user may not be allowed to read the file.
        shown = show_value(first["input"]) if key or place else _describe_kind(first["input"])
        problem = f"is {shown}, {_describe_bound(first)}"
        if first["type"] == "too_short" and isinstance(first["input"], Mapping):
            problem = "is empty, must have at least one entry"
    parts = [key, *place, *([at] if at else [])]
    return BadValueError(path, join_key(parts), problem)


def _describe_kind(content: Any) -> str:
    """Describes the type of a whole file's contents."""
    if content is None:
        return "empty"
    kinds = {list: "a list", dict: "a mapping", str: "a text"}
    return next((name for kind, name in kinds.items() if isinstance(content, kind)), "a single value")


def join_key(parts: Sequence[int | str]) -> str:
    """Formats a place in a file as ``tools[2].components``."""
    text = ""
    for part in parts:
        if isinstance(part, int):
            text += f"[{part}]"
        elif part:
            text += part if part.startswith("[") or not text else f".{part}"
    return text


def _describe_unknown(model: type[BaseModel], key: int | str) -> str:
    """Describes an unknown key, with a hint about the correct place or the most similar known key."""
    known = [field.alias or name for name, field in model.model_fields.items()]
    place = model.elsewhere.get(str(key)) if issubclass(model, DataModel) else None
    hint = f"; {place}" if place else suggest(key, known)
    return f"is not a key known here (known: {', '.join(known)}){hint}"


def _find_model(model: type[BaseModel], place: Sequence[int | str]) -> type[BaseModel]:
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
    found: type[BaseModel] = _strip(annotation)
    return found


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
    """Suggests that an unknown key is a misspelling of the missing key, if they are similar."""
    others = [str(each["loc"][-1]) for each in found if each["type"] == "extra_forbidden"]
    near = difflib.get_close_matches(str(place[-1]), others, n=1)
    return f"; is {near[0]!r} misspelt?" if near else ""


def _describe_bound(error: ErrorDetails) -> str:
    """Describes the bound that a value violates, in the same words as ``constraints``."""
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
