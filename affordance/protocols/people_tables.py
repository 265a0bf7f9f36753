"""Tables of people's results: published values that give their source, and single lifts, as in a run's lifts.csv."""

import math
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.bounded import RESULTS, read_csv, read_number
from affordance.protocols.block_entries import BlockEntry
from affordance.protocols.object_entries import ProtocolObjects

# Columns of published values.
_OF_PUBLISHED = ("quantity", "value", "low", "high", "unit", "source")
# Columns of lifts.csv; tables of people need not have all of them.
COLUMNS = (
    *("observer", "learner", "block", "cycle", "lift", "object", "mass", "size", "force", "expected"),
    *("believed_density", "kind", "surprise"),
)
_NEEDED = ("observer", "lift", "object", "force")


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
    if not rows or tuple(rows[0]) != _OF_PUBLISHED:
        found = ", ".join(rows[0]) if rows else "nothing"
        raise BadValueError(path, "row 1", f"names the columns {found}, must be {', '.join(_OF_PUBLISHED)}")
    values: dict[str, Published] = {}
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(_OF_PUBLISHED):
            raise BadValueError(path, f"row {number}", f"has {len(row)} columns, must have {len(_OF_PUBLISHED)}")
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


class PersonLifts(NamedTuple):
    """Lifts of one person in N presentations, in their order: indices of objects, (N,), and values of the table.

    Force before release, (N,), [N], is NaN where it was not measured, mass, (N,), [kg], where the table has none; the
    index of the block, (N,), is -1 without a column of blocks.
    """

    tool: NDArray[np.intp]
    force: Array
    mass: Array
    block: NDArray[np.intp]


class PeopleLifts(NamedTuple):
    """Single lifts of people, by name, from the table at a path."""

    path: Path
    people: Mapping[str, PersonLifts]


def load_people_lifts(path: Path, objects: ProtocolObjects, blocks: Sequence[BlockEntry]) -> PeopleLifts:
    """Reads a table with observer, lift, object and force at least; a BadValueError names row and column."""
    rows = read_csv(path, RESULTS)
    header = _check_header(path, rows[0] if rows else [])
    names, block_names = [tool.name for tool in objects.tools], [block.name for block in blocks]
    people: dict[str, dict[float, tuple[int, float, float, int]]] = {}  # by name and lift
    for number, cells in enumerate(rows[1:], start=2):
        if len(cells) != len(header):
            raise BadValueError(path, f"row {number}", f"has {len(cells)} columns, must have {len(header)}")
        row = dict(zip(header, cells, strict=True))
        if not row["observer"].strip():
            raise BadValueError(path, f"row {number}, observer", "is empty, must name the person")
        lift = read_number(path, number, "lift", row["lift"])
        force, mass = (
            read_number(path, number, column, row[column]) if row.get(column, "").strip() else math.nan
            for column in ("force", "mass")
        )
        tool = _find(path, number, "object", row["object"], names)
        block = _find(path, number, "block", row["block"], block_names) if row.get("block") else -1
        name = " ".join(part for part in (row.get("learner", ""), row["observer"]) if part)
        lifts = people.setdefault(name, {})
        if lift in lifts:
            raise BadValueError(path, f"row {number}, lift", f"is {lift:g}, which {name!r} has already")
        lifts[lift] = tool, force, mass, block
    if not people:
        raise BadValueError(path, "", "has no rows, must have one for each lift")
    columns = {name: zip(*(lifts[lift] for lift in sorted(lifts)), strict=True) for name, lifts in people.items()}
    return PeopleLifts(path, {name: PersonLifts(*map(np.array, each)) for name, each in columns.items()})


def _check_header(path: Path, header: Sequence[str]) -> Sequence[str]:
    for name in header:
        if name not in COLUMNS:
            raise BadValueError(path, "row 1", f"names a column that {describe_choice(name, COLUMNS)}")
        if list(header).count(name) > 1:
            raise BadValueError(path, "row 1", f"names the column {name!r} twice")
    missing = [name for name in _NEEDED if name not in header]
    if missing:
        raise BadValueError(path, "row 1", f"has no column {missing[0]!r}, must have {', '.join(_NEEDED)}")
    return header


def _find(path: Path, number: int, column: str, text: str, known: Sequence[str]) -> int:
    if text not in known:
        raise BadValueError(path, f"row {number}, {column}", describe_choice(text, known))
    return known.index(text)
