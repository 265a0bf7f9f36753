"""Reads tables of numbers from text files, such as CSV.

A table has an optional line of column names, and then one row of numbers per line. This module imports neither pandas
nor Drake, so that small commands start quickly.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError, show_value
from affordance.files import bounded

# Possible delimiters. The most frequent delimiter in the first line is used.
_DELIMITERS = ",;\t "


class TextTable(NamedTuple):
    """Table of finite numbers, with each row's line in the file."""

    names: list[str]  # names of the columns, length k; empty texts if the file has no names
    values: Array  # numbers, shape (N, k)
    rows: list[int]  # line number of each row in the file, from 1, length N


def read_table(path: Path, skipped: int = 0, skipping: str = "") -> TextTable:
    """Reads a table of numbers from a text file.

    Args:
        path: Text file. Numbers are separated by commas, semicolons, tabs or spaces.
        skipped: Number of rows above the table.
        skipping: Hint for users on how to skip rows.

    Raises:
        BadValueError: The file cannot be read, or a row is incomplete or contains something other than finite
            numbers; the message names the row.
    """
    lines = bounded.read_text(path, bounded.RECORDING, encoding="utf-8-sig").split("\n")
    rows = [number for number in range(skipped, len(lines)) if lines[number].strip()]
    if not rows:
        raise BadValueError(path, "", "is empty, must be a table with one row per sample")
    first = lines[rows[0]]
    delimiter = max(_DELIMITERS, key=first.count)
    names = _split(first, delimiter)
    has_names = _read_number(names[0]) is None
    columns, rows = names if has_names else [""] * len(names), rows[has_names:]
    values = np.empty((0, len(names)))
    try:
        if rows:
            values = np.loadtxt(
                [lines[number] for number in rows],
                delimiter=None if delimiter == " " else delimiter,
                comments=None,
                quotechar='"',
                ndmin=2,
            )
    except ValueError as error:  # a cell is not a number, or rows have different lengths
        raise _explain(path, lines, rows, names, delimiter, skipping) from error
    if values.shape[1] != len(names) or not np.isfinite(values).all():
        raise _explain(path, lines, rows, names, delimiter, skipping)
    return TextTable(columns, values, [number + 1 for number in rows])


def _split(line: str, delimiter: str) -> list[str]:
    cells = line.split(None if delimiter == " " else delimiter)
    return [cell.strip().strip('"') for cell in cells]


def _read_number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _explain(
    path: Path, lines: Sequence[str], rows: Sequence[int], names: Sequence[str], delimiter: str, skipping: str
) -> BadValueError:
    """Creates the error about the first row that does not have one finite number per column."""
    width = len(names)
    usual = Counter(len(_split(lines[number], delimiter)) for number in rows).most_common(1)[0][0]
    hint = "" if usual == width or not skipping else f" ({skipping})"
    for number in rows:
        cells = _split(lines[number], delimiter)
        if len(cells) != width:
            problem = f"has {len(cells)} values, must have {width}, one per column{hint}"
            return BadValueError(path, f"row {number + 1}", problem)
        for name, cell in zip(names, cells, strict=True):
            value = _read_number(cell)
            if value is None or not np.isfinite(value):
                point = cell.replace(",", ".")
                hint = f" with a decimal point, {point}" if _read_number(point) is not None and point != cell else ""
                problem = f"is {show_value(cell[:30])}, must be a finite number{hint}"
                return BadValueError(path, f"row {number + 1}, column {name}", problem)
    return BadValueError(path, "", f"is not a table of numbers separated by {delimiter!r}")
