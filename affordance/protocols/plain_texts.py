"""Check that the texts of a protocol are plain: templates are refused, since nothing would fill them in."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from affordance.exceptions import BadValueError, show_value
from affordance.files.data_model import join_key

# Beginnings of templates.
_MARKS = ("{{", "{%", "{#")


def refuse_templates(path: Path, content: Any) -> None:
    """Refuses a parsed file in which a text or a name contains the beginning of a template.

    Raises:
        BadValueError: A text or a name contains one.
    """
    waiting: list[tuple[tuple[int | str, ...], Any]] = [((), content)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping):
            waiting += [((*place, str(key)), each) for key, each in value.items()]
            waiting += [((*place, str(key)), key) for key in value]
        elif isinstance(value, list):
            waiting += [((*place, index), each) for index, each in enumerate(value)]
        elif isinstance(value, str) and (found := [mark for mark in _MARKS if mark in value]):
            problem = (
                f"is {show_value(value)}, must be plain text without {found[0]!r}: nothing is filled in; the report "
                "shows every number in a table of its own, and a claim compares numbers by an expression"
            )
            raise BadValueError(path, join_key(place), problem)
