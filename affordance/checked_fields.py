"""Fields of dataclasses with bounds as annotations, such as ``Annotated[float, Within(0.0, 1.0)]``.

``check_fields`` checks all of them when an object is created; a ``Setting`` next to the bound gives unit and source.
"""

import dataclasses
import enum
import types
import typing
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from affordance.exceptions import BadArgumentError, show_value
from affordance.files.constraints import OneOf, check_path, run_check


@dataclasses.dataclass(frozen=True)
class Setting:
    """Unit of a setting and source of its value, as an annotation of a field.

    Attributes:
        unit: Unit, "1" if dimensionless; empty for a setting that is not a number.
        source: Source of the default value, or reason for it.
    """

    unit: str = ""
    source: str = ""


@dataclasses.dataclass(frozen=True)
class Checked:
    """Annotation of a field whose value is checked by a function.

    Attributes:
        function: Function of the argument's name and its value, which returns the checked value.
    """

    function: Callable[[str, Any], Any]


def check_fields(instance: Any) -> None:
    """Checks all fields of a dataclass by their annotations, and replaces them by the checked values.

    Supported are annotations with a check (``Within``, ``Whole``, ``OneOf``, ``Checked``), members of an Enum or
    their texts, paths, truth values, and instances of a class; None where a field may be None.

    Raises:
        BadArgumentError: A field is of the wrong kind or out of bounds.
    """
    kind: Any = type(instance)
    for name, hint in list_field_types(kind).items():
        value = getattr(instance, name)
        checked = _check_field(hint, kind.__name__, name, value)
        if checked is not value:
            object.__setattr__(instance, name, checked)


class CheckedFields:
    """Base of dataclasses of which every field is checked by its annotation when an object is created.

    Raises:
        BadArgumentError: A value is not of its field's type, is not finite, or is out of bounds.
    """

    def __post_init__(self) -> None:
        """Checks the fields."""
        check_fields(self)


@lru_cache(maxsize=64)
def list_field_types(kind: Any) -> Mapping[str, Any]:
    """Lists the types of the fields of a dataclass, with their annotations, by name."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _check_field(hint: Any, owner: str, name: str, value: Any) -> Any:
    hint = getattr(hint, "__value__", hint)  # the value of a ``type`` statement
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        if value is None:
            return None
        (hint,) = (each for each in typing.get_args(hint) if each is not types.NoneType)
        return _check_field(hint, owner, name, value)
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
    if hint is Path:
        try:
            return check_path(name, value)
        except BadArgumentError as error:
            raise BadArgumentError(owner, name, error.problem) from error
    if isinstance(hint, type) and not isinstance(value, hint):
        wanted = "true or false" if hint is bool else f"a {hint.__name__}"
        raise BadArgumentError(owner, name, f"is {show_value(value)}, must be {wanted}")
    return value
