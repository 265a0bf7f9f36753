"""Tables of recordings: text with one row per sample (CSV), and netCDF 3."""

import csv
import math
import warnings
from array import array
from collections.abc import Iterator, Mapping
from io import BytesIO, StringIO
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.files import bounded

# Possible delimiters of a text; the most frequent one in the first line is used.
_DELIMITERS = ",;\t "
# Largest number of characters in a row; the log of a robot controller has some hundred columns.
_LONGEST_ROW = 100_000
_LISTED, _ENOUGH_TORN = 10, 1000  # numbers of torn rows that a message lists, and after which the search stops


class RunTable(NamedTuple):
    """Table of numbers."""

    names: tuple[str, ...]  # names of the columns; empty if the file has none
    values: Array  # values, shape (N, number of columns)
    rows: NDArray[np.intp]  # row of the file that holds each sample, from 1, shape (N,)
    num_torn: int = 0  # number of incomplete rows that were left out
    joint_names: tuple[str, ...] = ()  # names of the joints if the file gives them

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> "RunTable":
        """Builds a table from arrays, (N,) or (N, C); the columns of a matrix become NAME_1, NAME_2 and so on."""
        names: list[str] = []
        for name, values in arrays.items():
            names += [name] if values.ndim == 1 else [f"{name}_{i + 1}" for i in range(values.shape[1])]
        table = np.column_stack(list(arrays.values()))
        return cls(tuple(names), table, np.arange(1, len(table) + 1))


def read_text(path: Path, max_torn: int = 0, skipped: int = 0) -> RunTable:
    """Reads rows of numbers, with or without a header line, after a number of skipped rows.

    Raises:
        BadValueError: The file cannot be read, or has more than ``max_torn`` incomplete rows, which the message
            names.
    """
    text = bounded.read_text(path, bounded.RECORDING, encoding="utf-8-sig")
    lines = text.splitlines(keepends=True)[skipped:]
    rows = _split_rows(path, "".join(lines), skipped)
    first = next(rows, [])
    if not first:
        raise BadValueError(path, "", "is empty, must be a table with one row per sample")
    names = () if _is_number(first[0]) else tuple(first)
    width = len(first)
    top = skipped + (2 if names else 1)
    whole = _read_whole(lines[1:] if names else lines, _find_delimiter(lines[0]), width)
    if whole is not None:
        return RunTable(names, whole, np.arange(top, top + len(whole)))
    samples, numbers = array("d"), array("q")  # a number takes eight bytes, its text ten times as many
    torn: list[tuple[int, str, str]] = []
    for number, row in enumerate(rows if names else chain([first], rows), start=top):
        if not row:
            continue
        problem = _find_problem(row, width, names)
        if problem is None:
            samples.extend(map(float, row))
            numbers.append(number)
        else:
            torn.append((number, *problem))
            if len(torn) > max_torn + _ENOUGH_TORN:
                break
    if len(torn) > max_torn:
        if len(numbers) < len(torn) and (head := _count_head(lines)):
            where = f"rows {skipped + 1} to {skipped + head}" if head > 1 else f"row {skipped + 1}"
            above = f"precedes the table (skip_rows: {skipped + head} skips everything above it)"
            raise BadValueError(path, where, above)
        raise _refuse_torn(path, torn, max_torn, len(numbers))
    values = np.array(samples, dtype=float).reshape(-1, width)
    return RunTable(names, values, np.array(numbers, dtype=np.intp), len(torn))


def _find_delimiter(line: str) -> str:
    """Finds the most frequent delimiter in a line."""
    return max(_DELIMITERS, key=line.count)


def _read_whole(lines: list[str], delimiter: str, width: int) -> Array | None:
    """Reads rows without gaps much faster than cell by cell, shape (N, width); None if a row is incomplete."""
    if max(map(len, lines), default=0) > _LONGEST_ROW:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about tables without rows
            values = np.loadtxt(lines, delimiter=None if delimiter == " " else delimiter, comments=None, ndmin=2)
    except ValueError:
        return None
    is_whole = values.shape == (len(lines), width) and np.isfinite(values).all()
    return values if is_whole else None


def _count_head(lines: list[str]) -> int:
    """Counts the lines above the first one with the most common number of cells."""
    delimiter = _find_delimiter(next((line for line in reversed(lines) if line.strip()), ""))
    counts = [len(line.split() if delimiter == " " else line.split(delimiter)) for line in lines]
    return counts.index(max(set(counts), key=counts.count))


def _refuse_torn(path: Path, torn: list[tuple[int, str, str]], max_torn: int, num_whole: int) -> BadValueError:
    """Builds the error about incomplete rows: the first one too many, and the numbers of all."""
    number, where, what = torn[max_torn]
    if num_whole < len(torn):
        advice = "skip_rows: N skips N rows above a table"
    elif max_torn:
        advice = f"drop_torn_rows: {max_torn} allows no more"
    else:
        advice = "drop_torn_rows: N leaves out up to N"
    listed = ", ".join(str(each) for each, *_ in torn[:_LISTED])
    more = f" and {len(torn) - _LISTED} more" if len(torn) > _LISTED else ""
    every = f"; torn rows: {listed}{more}" if len(torn) > 1 else ""
    return BadValueError(path, f"row {number}{where}", f"{what}{every} ({advice})")


def _split_rows(path: Path, text: str, skipped: int) -> Iterator[list[str]]:
    """Splits a text into the cells of each row, at the most frequent delimiter of its first line.

    Raises:
        BadValueError: A row is too long for any robot, or is not a row of a table.
    """
    delimiter = _find_delimiter(text.split("\n", 1)[0])
    number, length = skipped + 1, 0

    def feed() -> Iterator[str]:
        nonlocal length
        for line in StringIO(text):
            length += len(line)  # a row may span several lines within quotation marks
            if length > _LONGEST_ROW:
                raise BadValueError(path, f"row {number}", f"is longer than {_LONGEST_ROW} characters")
            yield line

    try:
        for row in csv.reader(feed(), delimiter=delimiter):
            cells = [cell.strip() for cell in row]
            yield [cell for cell in cells if cell] if delimiter == " " else cells
            number, length = number + 1, 0
    except csv.Error as error:
        raise BadValueError(path, f"row {number}", f"is not a row of a table: {error}") from error


def read_netcdf(path: Path) -> RunTable:
    """Reads variables along time; the columns of a matrix become NAME_1, NAME_2 and so on.

    Raises:
        BadValueError: The file cannot be read, has no time, or has variables of other lengths.
    """
    import xarray  # here, because it takes a third of a second

    content = bounded.read_bytes(path, bounded.RECORDING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about damaged files, which are rejected below
            with xarray.open_dataset(BytesIO(content), engine="scipy", decode_cf=False) as dataset:
                promised = sum(each.size for each in dataset.variables.values())
                if promised > len(content):
                    raise ValueError(f"its header declares {promised:.3g} numbers in {len(content)} bytes")
                # Apply the file's scales and offsets.
                decoded = {
                    str(name): xarray.conventions.decode_cf_variable("x", each, decode_times=False).values
                    for name, each in dataset.variables.items()
                }
                variables = {name: np.asarray(values, dtype=float) for name, values in decoded.items()}
    except MemoryError:
        raise
    except Exception as error:  # the libraries raise any exception on a damaged file
        raise BadValueError(path, "", f"is not a netCDF 3 file of numbers: {error}") from error
    if "time" not in variables:
        raise BadValueError(path, "time", f"is missing among {', '.join(variables)}")
    length = len(variables["time"])
    for name, values in variables.items():
        if values.ndim not in (1, 2) or len(values) != length:
            problem = f"has shape {values.shape}, must have the {length} samples of time along its first dimension"
            raise BadValueError(path, name, problem)
    return RunTable.from_arrays(variables)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _find_problem(row: list[str], width: int, names: tuple[str, ...]) -> tuple[str, str] | None:
    """Returns the column and the problem of an invalid row; None for a valid one."""
    if len(row) != width:
        return "", f"has {len(row)} values, must have {width}, one per column"
    for label, cell in zip(names or range(1, width + 1), row, strict=True):
        if not _is_number(cell):
            return f", column {label}", f"is {cell[:30]!r}, must be a number"
        if math.isnan(float(cell)):
            return f", column {label}", "is nan, must be a finite number"
    return None
