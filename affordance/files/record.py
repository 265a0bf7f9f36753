"""Reader of single values from a YAML file, whose errors name file, key, value and bound.

A Record is a mapping of a file together with its key. Each value is read with its bounds; ``finish`` then rejects
keys that were never read, so that a misspelt optional key is not ignored.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.files.yaml_reader import read_yaml


def read_record(path: Path) -> "Record":
    """Reads a YAML file whose top level is a mapping.

    Raises:
        BadValueError: The file cannot be read, is not YAML, repeats a key, or is not a mapping.
    """
    return Record(path, "", read_yaml(path))


class Record:
    """Mapping in a YAML file, with the file's path and the mapping's key."""

    def __init__(self, path: Path, key: str, content: Any) -> None:
        """Stores the parsed content at a key of a file.

        Raises:
            BadValueError: The content is not a mapping.
        """
        self.path = path
        self.key = key
        if not isinstance(content, Mapping):
            raise BadValueError(path, key, f"is {show_value(content)}, must be a mapping of keys to values")
        self._content: dict[Any, Any] = dict(content)
        self._unread = set(self._content)

    def error(self, name: str, problem: str) -> BadValueError:
        """Builds the error for a problem with one of this record's values."""
        return BadValueError(self.path, self._key_of(name), problem)

    def has(self, name: str) -> bool:
        """Returns True if an optional key is given."""
        return name in self._content

    def holds_list(self, name: str) -> bool:
        """Returns True if a key holds a list."""
        return isinstance(self._content.get(name), list)

    def names(self, name: str) -> tuple[str, ...]:
        """Reads a list of non-empty texts, at least one.

        Raises:
            BadValueError: The key is missing, not such a list, or an entry is not a non-empty text.
        """
        values = self._take_list(name)
        for i, value in enumerate(values):
            if not isinstance(value, str) or not value.strip():
                raise self.error(f"{name}[{i}]", f"is {show_value(value)}, must be a non-empty text")
        return tuple(values)

    def text(self, name: str) -> str:
        """Reads a non-empty text.

        Raises:
            BadValueError: The key is missing or not a non-empty text.
        """
        value = self._take(name)
        if not isinstance(value, str) or not value.strip():
            raise self.error(name, f"is {show_value(value)}, must be a non-empty text")
        return value

    def texts(self, name: str) -> list[str]:
        """Reads a non-empty list of non-empty texts.

        Raises:
            BadValueError: The key is missing, not such a list, or an entry is not a non-empty text.
        """
        values = self._take_list(name)
        for i, value in enumerate(values):
            if not isinstance(value, str) or not value.strip():
                raise self.error(f"{name}[{i}]", f"is {show_value(value)}, must be a non-empty text")
        return [str(value) for value in values]

    def number(self, name: str, *, low: float = -math.inf, high: float = math.inf) -> float:
        """Reads a finite number from ``low`` to ``high``.

        Raises:
            BadValueError: The key is missing, not a finite number, or out of bounds.
        """
        return self._check_number(name, self._take(name), low, high)

    def vector(self, name: str, size: int, *, low: float = -math.inf, high: float = math.inf) -> Array:
        """Reads a list of ``size`` finite numbers, each from ``low`` to ``high``.

        Raises:
            BadValueError: The key is missing, not such a list, or one of its numbers is out of bounds.
        """
        return self._check_vector(name, self._take(name), size, low, high)

    def vectors(self, name: str, size: int, *, low: float = -math.inf, high: float = math.inf) -> Array:
        """Reads a non-empty list of lists of ``size`` finite numbers from ``low`` to ``high``, shape (count, size).

        Raises:
            BadValueError: The key is missing, not such a list, or one of its numbers is out of bounds.
        """
        values = self._take_list(name)
        return np.array([self._check_vector(f"{name}[{i}]", row, size, low, high) for i, row in enumerate(values)])

    def record(self, name: str) -> "Record":
        """Reads a mapping.

        Raises:
            BadValueError: The key is missing, or not a mapping.
        """
        return Record(self.path, self._key_of(name), self._take(name))

    def numbers(self, *, low: float = -math.inf, high: float = math.inf) -> dict[str, float]:
        """Reads every entry of this mapping as a named finite number from ``low`` to ``high``.

        Raises:
            BadValueError: A name is not a text, or a value is not such a number.
        """
        for name in self._content:
            if not isinstance(name, str):
                raise BadValueError(self.path, self.key, f"the key {show_value(name)} must be a text")
        return {name: self.number(name, low=low, high=high) for name in self._content}

    def records(self, name: str) -> Iterator["Record"]:
        """Reads a non-empty list of mappings.

        Raises:
            BadValueError: The key is missing, not a list, empty, or holds something that is not a mapping.
        """
        for i, value in enumerate(self._take_list(name)):
            yield Record(self.path, self._key_of(f"{name}[{i}]"), value)

    def named_records(self) -> Iterator[tuple[str, "Record"]]:
        """Reads every entry of this mapping as a named mapping.

        Raises:
            BadValueError: The mapping is empty, or a name is not a text, or a value not a mapping.
        """
        if not self._content:
            raise BadValueError(self.path, self.key, "is empty, must hold at least one entry")
        for name in self._content:
            if not isinstance(name, str):
                raise BadValueError(self.path, self.key, f"the key {show_value(name)} must be a text")
            yield name, Record(self.path, self._key_of(name), self._take(name))

    def finish(self) -> None:
        """Rejects keys that were never read.

        Raises:
            BadValueError: There is such a key.
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

    def _take_list(self, name: str) -> list[Any]:
        values = self._take(name)
        if not isinstance(values, list) or not values:
            raise self.error(name, f"is {show_value(values)}, must be a list with at least one entry")
        return values

    def _check_vector(self, name: str, values: Any, size: int, low: float, high: float) -> Array:
        if not isinstance(values, list) or len(values) != size:
            raise self.error(name, f"is {show_value(values)}, must be a list of {size} numbers")
        return np.array([self._check_number(f"{name}[{i}]", value, low, high) for i, value in enumerate(values)])

    def _check_number(self, name: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(name, f"is {show_value(value)}, must be a number")
        if not low <= value <= high:  # before float(), which an integer of 400 digits would overflow
            bounds = f"must be from {low:g} to {high:g}" if math.isfinite(high) else f"must be at least {low:g}"
            raise self.error(name, f"is {show_value(value)}, {bounds if math.isfinite(low) else 'must be finite'}")
        try:
            number = float(value)
        except OverflowError as error:
            raise self.error(name, f"is {show_value(value)}, must be finite") from error
        if not math.isfinite(number):
            raise self.error(name, f"is {number}, must be finite")
        return number
