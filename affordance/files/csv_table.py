"""Reader of users' tables of comma-separated values, with a one-line error for every mistake."""

import csv
import math
from io import StringIO
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.files.bounded import SETTINGS, read_text


def read_csv(path: Path, most: int = SETTINGS) -> list[list[str]]:
    """Reads the rows of a table of at most ``most`` bytes, starting with the row of column names.

    Raises:
        BadValueError: The file cannot be read, is larger, or is not such a table.
    """
    try:
        return list(csv.reader(StringIO(read_text(path, most)), strict=True))
    except csv.Error as error:
        raise BadValueError(path, "", f"is not a table of comma-separated values: {error}") from error


def read_number(path: Path, row: int, column: str, text: str) -> float:
    """Parses a cell as a finite number.

    Raises:
        BadValueError: The cell is not a finite number.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadValueError(path, f"row {row}, {column}", f"is {text!r}, must be a finite number")
    return value
