"""Tables of recordings: text with one row a sample (CSV), and netCDF 3."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError

# Of a text's first line, most frequent wins.
_DELIMITERS = ",;\t "


class Table(NamedTuple):
    """Columns of numbers.

    Attributes:
        names: Of the columns; empty if the file has none.
        values: Shape (N, len(names)).
        rows: Row of the file, counted from 1, that holds each sample, shape (N,).
        num_torn: Rows that were left out.
    """

    names: tuple[str, ...]
    values: Array
    rows: NDArray[np.intp]
    num_torn: int


def read_text(path: Path, max_torn: int = 0) -> Table:
    """Reads rows of numbers, with or without a line of names above.

    Args:
        path: The file.
        max_torn: How many rows that are not whole may be left out.

    Raises:
        BadValueError: It cannot be read, or has more torn rows than that; names the first of them.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
    first_line = text.split("\n", 1)[0]
    delimiter = max(_DELIMITERS, key=first_line.count)
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.splitlines(), delimiter=delimiter)]
    if delimiter == " ":
        rows = [[cell for cell in row if cell] for row in rows]
    if not rows or not rows[0]:
        raise BadValueError(path, "", "is empty, must be a table with one row a sample")
    names: tuple[str, ...] = ()
    if not _is_number(rows[0][0]):
        names = tuple(rows[0])
    first_row = 2 if names else 1
    width = len(names or rows[0])
    samples, numbers, num_torn = [], [], 0
    for number, row in enumerate(rows[first_row - 1 :], start=first_row):
        if not row:
            continue
        problem = _find_problem(row, width, names)
        if problem is None:
            samples.append([float(cell) for cell in row])
            numbers.append(number)
        elif num_torn < max_torn:
            num_torn += 1
        else:
            column, what = problem
            more = (
                f" (drop_torn_rows: {max_torn} is used up)" if max_torn else " (drop_torn_rows: N leaves out up to N)"
            )
            raise BadValueError(path, f"row {number}{column}", what + more)
    return Table(names, np.array(samples).reshape(-1, width), np.array(numbers, dtype=np.intp), num_torn)


def read_netcdf(path: Path) -> Table:
    """Reads variables over one dimension, time; those with a second become NAME_1, NAME_2 and so on.

    Raises:
        BadValueError: It cannot be read, has no time, or variables of other lengths.
    """
    try:
        dataset = xarray.load_dataset(path, engine="scipy", decode_times=False)
        variables = {str(name): np.asarray(each.values, dtype=float) for name, each in dataset.variables.items()}
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror or error}") from error
    except (TypeError, ValueError, IndexError) as error:
        raise BadValueError(path, "", f"is not netCDF 3 of numbers: {error}") from error
    if "time" not in variables:
        raise BadValueError(path, "time", f"is missing among {', '.join(variables)}")
    return _flatten(path, variables)


def _flatten(path: Path, variables: Mapping[str, Array]) -> Table:
    length = len(variables["time"])
    names, columns = [], []
    for name, values in variables.items():
        if values.ndim not in (1, 2) or len(values) != length:
            problem = f"has shape {values.shape}, must have the {length} samples of time along its first dimension"
            raise BadValueError(path, name, problem)
        if values.ndim == 1:
            names.append(name)
            columns.append(values)
        else:
            names += [f"{name}_{i + 1}" for i in range(values.shape[1])]
            columns += list(values.T)
    return Table(tuple(names), np.column_stack(columns), np.arange(1, length + 1), 0)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _find_problem(row: list[str], width: int, names: tuple[str, ...]) -> tuple[str, str] | None:
    """What is wrong with a row, and in which column; None if it is whole."""
    if len(row) != width:
        return "", f"has {len(row)} values, must have {width}, one a column"
    for place, cell in enumerate(row):
        if not _is_number(cell):
            label = names[place] if names else str(place + 1)
            return f", column {label}", f"is {cell[:30]!r}, must be a number"
        if math.isnan(float(cell)):
            label = names[place] if names else str(place + 1)
            return f", column {label}", "is nan, must be a finite number"
    return None
