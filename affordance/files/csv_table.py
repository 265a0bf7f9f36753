"""Tables of comma-separated values that users write: read with one line for every mistake."""

import csv
import math
from pathlib import Path

from affordance.exceptions import BadValueError


def read_csv(path: Path) -> list[list[str]]:
    """Reads the rows of a table, that of the columns' names first.

    Raises:
        BadValueError: The file cannot be read, or is no such table.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.reader(file, strict=True))
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
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
