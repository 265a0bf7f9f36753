"""Reading YAML files so that every mistake is named by file, key, value and bound.

A Record is a mapping of a file together with where it stands there. Values are taken out of it one by one, each
with its bound; ``finish`` then refuses keys nobody asked for, so that a misspelt optional key is not ignored.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from pydrake.common.yaml import yaml_load_file

from affordance.exceptions import BadValueError


def read_record(path: Path) -> "Record":
    """Reads a YAML file whose top level is a mapping.

    Raises:
        BadValueError: The file cannot be read, is not YAML, or is not a mapping.
    """
    try:
        content = yaml_load_file(path, private=True)  # type: ignore[no-untyped-call]  # Drake leaves it unannotated
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
    except (yaml.YAMLError, RuntimeError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        reason = getattr(error, "problem", None) or str(error)
        raise BadValueError(path, where, f"is not YAML: {reason}") from error
    return Record(path, "", content)


class Record:
    """A mapping inside a YAML file, with the file's path and the key that leads to it."""

    def __init__(self, path: Path, key: str, content: Any) -> None:
        """Takes the parsed content found at a key of a file.

        Raises:
            BadValueError: The content is not a mapping.
        """
        self.path = path
        self.key = key
        if not isinstance(content, Mapping):
            raise BadValueError(path, key, f"is {_shown(content)}, must be a mapping of keys to values")
        self._content: dict[Any, Any] = dict(content)
        self._unread = set(self._content)

    def error(self, name: str, problem: str) -> BadValueError:
        """Builds the error for a problem with one of this record's values."""
        return BadValueError(self.path, self._key_of(name), problem)

    def has(self, name: str) -> bool:
        """Says whether an optional key is given."""
        return name in self._content

    def text(self, name: str) -> str:
        """Takes a non-empty text.

        Raises:
            BadValueError: The key is missing or not a non-empty text.
        """
        value = self._take(name)
        if not isinstance(value, str) or not value.strip():
            raise self.error(name, f"is {_shown(value)}, must be a non-empty text")
        return value

    def number(self, name: str, *, above: float = -math.inf, at_least: float = -math.inf) -> float:
        """Takes a finite number greater than ``above`` and not less than ``at_least``.

        Raises:
            BadValueError: The key is missing, not a finite number, or out of bounds.
        """
        return self._checked_number(name, self._take(name), above=above, at_least=at_least)

    def vector(self, name: str, size: int, *, above: float = -math.inf) -> NDArray[np.float64]:
        """Takes a list of ``size`` finite numbers, each greater than ``above``.

        Raises:
            BadValueError: The key is missing, not such a list, or one of its numbers is out of bounds.
        """
        values = self._take(name)
        if not isinstance(values, list) or len(values) != size:
            raise self.error(name, f"is {_shown(values)}, must be a list of {size} numbers")
        return np.array([self._checked_number(f"{name}[{i}]", value, above=above) for i, value in enumerate(values)])

    def records(self, name: str) -> Iterator["Record"]:
        """Takes a non-empty list of mappings.

        Raises:
            BadValueError: The key is missing, not a list, empty, or holds something that is not a mapping.
        """
        values = self._take(name)
        if not isinstance(values, list) or not values:
            raise self.error(name, f"is {_shown(values)}, must be a list with at least one entry")
        for i, value in enumerate(values):
            yield Record(self.path, self._key_of(f"{name}[{i}]"), value)

    def named_records(self) -> Iterator[tuple[str, "Record"]]:
        """Takes every entry of this mapping as a named mapping.

        Raises:
            BadValueError: The mapping is empty, or a name is not a text, or a value not a mapping.
        """
        if not self._content:
            raise BadValueError(self.path, self.key, "is empty, must hold at least one entry")
        for name in self._content:
            if not isinstance(name, str):
                raise BadValueError(self.path, self.key, f"the key {_shown(name)} must be a text")
            yield name, Record(self.path, self._key_of(name), self._take(name))

    def finish(self) -> None:
        """Refuses keys that were never taken.

        Raises:
            BadValueError: A key is left over.
        """
        for name in sorted(map(str, self._unread)):
            known = ", ".join(sorted(str(key) for key in self._content if key not in self._unread))
            raise self.error(name, f"is not a key known here (known and given: {known})")

    def _key_of(self, name: str) -> str:
        return f"{self.key}.{name}" if self.key else name

    def _take(self, name: str) -> Any:
        if name not in self._content:
            raise self.error(name, "is missing")
        self._unread.discard(name)
        return self._content[name]

    def _checked_number(
        self, name: str, value: Any, *, above: float = -math.inf, at_least: float = -math.inf
    ) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(name, f"is {_shown(value)}, must be a number")
        if not math.isfinite(value):
            raise self.error(name, f"is {value}, must be finite")
        if value <= above:
            raise self.error(name, f"is {value}, must be greater than {above:g}")
        if value < at_least:
            raise self.error(name, f"is {value}, must be at least {at_least:g}")
        return float(value)


def _shown(value: Any) -> str:
    """Describes a value in a few words, however long it is."""
    if value is None:
        return "empty"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
