"""Tables of comma-separated values that users write: read with one line for every mistake."""

import csv
import math
from io import StringIO
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.files.bounded import SETTINGS, read_text


def read_csv(path: Path, most: int = SETTINGS) -> list[list[str]]:
    """Reads the rows of a table of at most so many bytes, that of the columns' names first.

    Raises:
        BadValueError: The file cannot be read, is larger, or is no such table.
    """
    try:
        return list(csv.reader(StringIO(read_text(path, most)), strict=True))
    except csv.Error as error:
        raise BadValueError(path, "", f"is not a table of comma-separated values: {error}") from error


def read_number(path: Path, row: int, column: str, text: str) -> float:
    """Reads a cell.

    Raises:
        BadValueError: It is not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadValueError(path, f"row {row}, {column}", f"is {text!r}, must be a finite number")
    return value
