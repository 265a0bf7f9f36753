"""Reading of external files with a bound on their size, which depends on the kind of file.

Sizes are checked before reading, so that an oversized file costs nothing. Each bound is a generous multiple of the
usual size, and small enough that reading a file takes some minutes and some gigabytes at most. Every mistake gives
a one-line error.
"""

import csv
import json
import math
import stat
from io import StringIO
from pathlib import Path
from typing import Any

from affordance.exceptions import BadValueError

_MB = 1_000_000
# Protocols, tools, materials and other settings in YAML, and tables of human data: the largest of our own has 8 kB.
SETTINGS = 1 * _MB
# Descriptions of robots in XML, with meshes in separate files: a link takes some kB.
ROBOT = 10 * _MB
# Meshes: a scanner's 2 million triangles in binary STL have 100 MB.
MESH = 200 * _MB
# Recordings: 15 minutes of seven joints at 1 kHz as text have 200 MB.
RECORDING = 200 * _MB
# Results of our own programs: memories, sections, metrics, summaries.
RESULTS = 100 * _MB


def read_bytes(path: Path, most: int) -> bytes:
    """Reads a file of at most ``most`` bytes.

    Raises:
        BadValueError: The file cannot be read, is not a regular file, or is larger.
    """
    try:
        check_size(path, most)
        with path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise BadValueError(path, "", f"cannot be read: {error.strerror}") from error
    if len(content) > most:  # it grew, or its file system does not report its size
        raise _complain(path, len(content), most)
    return content


def read_text(path: Path, most: int, encoding: str = "utf-8") -> str:
    """Reads a text of at most ``most`` bytes; line ends become newlines.

    Raises:
        BadValueError: The file cannot be read, is not a regular file, is larger, or is not text in the encoding.
    """
    try:
        text = read_bytes(path, most).decode(encoding)
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: Path, most: int = RESULTS) -> Any:
    """Reads a JSON file of at most ``most`` bytes.

    Raises:
        BadValueError: The file cannot be read, is larger, or is not JSON.
    """
    try:
        return json.loads(read_text(path, most))
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not JSON: {error}") from error


def check_size(path: Path, most: int) -> None:
    """Rejects devices, pipes and sockets, whose reading might never end, and files of more than ``most`` bytes.

    Raises:
        BadValueError: The path is inaccessible, is a device, a pipe or a socket, or the file is larger.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:  # a name with a NUL is a ValueError
        raise BadValueError(path, "", f"cannot be read: {getattr(error, 'strerror', error)}") from error
    if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
        raise BadValueError(path, "", "cannot be read: it is a device, a pipe or a socket, must be a file")
    if stat.S_ISREG(found.st_mode) and found.st_size > most:
        raise _complain(path, found.st_size, most)


def _complain(path: Path, size: int, most: int) -> BadValueError:
    return BadValueError(path, "", f"has {size / _MB:.3g} MB, must have at most {most / _MB:g} MB")


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
