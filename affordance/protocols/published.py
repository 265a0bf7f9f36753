"""Published measurements of people, read from small tables that give their source."""

import math
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

from affordance.exceptions import BadValueError
from affordance.files.bounded import read_csv, read_number

_COLUMNS = ("quantity", "value", "low", "high", "unit", "source")


class Published(NamedTuple):
    """Mean over people in an SI unit (1 for none), its 95 % interval, NaN if none is published, and the source."""

    value: float
    low: float
    high: float
    unit: str
    source: str


class PublishedTable(NamedTuple):
    """Published values of a group of people, by quantity in the order of the rows."""

    path: Path
    values: Mapping[str, Published]

    def get(self, quantity: str) -> Published:
        """Returns the value of a quantity; raises a BadValueError, with the nearest name, if it is missing."""
        if quantity not in self.values:
            near = get_close_matches(quantity, self.values, n=1)
            hint = f"; nearest is {near[0]!r}" if near else ""
            known = ", ".join(self.values)
            raise BadValueError(self.path, "quantity", f"has no row {quantity!r}, which is needed; has {known}{hint}")
        return self.values[quantity]


def load_published(path: Path) -> PublishedTable:
    """Reads a table of quantity, value, low, high, unit and source; a BadValueError names row and column."""
    rows = read_csv(path)
    if not rows or tuple(rows[0]) != _COLUMNS:
        found = ", ".join(rows[0]) if rows else "nothing"
        raise BadValueError(path, "row 1", f"names the columns {found}, must be {', '.join(_COLUMNS)}")
    values: dict[str, Published] = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(_COLUMNS):
            raise BadValueError(path, f"row {number}", f"has {len(row)} columns, must have {len(_COLUMNS)}")
        quantity = row[0]
        if not quantity or quantity in values:
            problem = f"is {quantity!r}, " + ("which an earlier row has" if quantity else "must be a name")
            raise BadValueError(path, f"row {number}, quantity", problem)
        values[quantity] = _read_row(path, number, row)
    return PublishedTable(path, values)


def _read_row(path: Path, number: int, row: list[str]) -> Published:
    _, value_text, low_text, high_text, unit, source = row
    value = read_number(path, number, "value", value_text)
    if bool(low_text) != bool(high_text):
        missing = "low" if high_text else "high"
        raise BadValueError(path, f"row {number}, {missing}", "is empty, must be given as the other end is")
    low = read_number(path, number, "low", low_text) if low_text else math.nan
    high = read_number(path, number, "high", high_text) if high_text else math.nan
    if low > value or value > high:
        key = f"row {number}, {'low' if low > value else 'high'}"
        bound = f"{low:g}, must be at most" if low > value else f"{high:g}, must be at least"
        raise BadValueError(path, key, f"is {bound} the value {value:g}")
    for name, text in (("unit", unit), ("source", source)):
        if not text.strip():
            raise BadValueError(path, f"row {number}, {name}", "is empty, must be given")
    return Published(value, low, high, unit, source)
