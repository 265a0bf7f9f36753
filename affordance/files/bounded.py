"""Reads external files with a size limit for each kind of file.

Sizes are checked before reading, so an oversized file costs nothing. Each limit is a generous multiple of the usual
size, and small enough that reading a file takes a few minutes and gigabytes at most. Every fault raises a one-line
error.
"""

import difflib
import json
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from affordance.exceptions import BadValueError, show_value, suggest

_MB = 1_000_000
# Tools, materials and other settings in YAML: the program's largest file has 8 kB.
SETTINGS = 1 * _MB
# Robot descriptions in XML, with meshes in separate files: a link takes a few kB.
ROBOT = 10 * _MB
# Meshes: 2 million triangles from a scanner take 100 MB in binary STL.
MESH = 200 * _MB
# Recordings: 15 minutes of seven joints at 1 kHz take 200 MB as text.
RECORDING = 200 * _MB
# Results of the program itself: memories, sections, metrics, summaries.
RESULTS = 100 * _MB
# Contents of a file that PyYAML quotes in messages; hidden, because the user may have no right to read the file.
_QUOTED = re.compile(r"(alias|anchor|tag|handle|base \d+:|to float:) '.*?'")
# Least similarity (difflib's ratio) of file names that differ by a typing error: one letter of seven gives 0.86.
_ALIKE = 0.8


def read_bytes(path: Path, most: int) -> bytes:
    """Reads a regular file of at most ``most`` bytes. Any other file raises a BadValueError."""
    try:
        check_size(path, most)
        with path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        bound = ", must be a file" if isinstance(error, IsADirectoryError) else ""
        raise BadValueError(path, "", f"cannot be read: {error.strerror}{bound}") from error
    if len(content) > most:  # the file grew, or its file system reports no size
        raise _complain(path, len(content), most)
    return content


def suggest_file(path: Path) -> str:
    """Suggests the file in the same folder with the closest name. The text is empty if no name is close."""
    try:
        files = (each for each in path.parent.iterdir() if _is_alike(path.stem, each.stem))
        return suggest(path.name, [each.name for each in files])
    except (OSError, ValueError):
        return ""


def _is_alike(one: str, other: str) -> bool:
    """Returns True if names differ by one or two typing errors.

    Suffixes are ignored because most files share them.
    """
    return difflib.SequenceMatcher(None, one, other).ratio() >= _ALIKE


def read_text(path: Path, most: int, encoding: str = "utf-8") -> str:
    """Reads a text file of at most ``most`` bytes, with newlines as line ends. Faults raise a BadValueError."""
    try:
        text = read_bytes(path, most).decode(encoding)
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: Path) -> Any:
    """Reads a JSON file. An unreadable file, an oversized file, or invalid JSON raises a BadValueError."""
    try:
        return json.loads(read_text(path, RESULTS))
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not JSON: {error}") from error


def check_size(path: Path, most: int) -> None:
    """Checks that a file has at most ``most`` bytes.

    A larger file, a device, a pipe or a socket raises a BadValueError.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:  # a name that contains NUL raises a ValueError
        problem = f"cannot be read: {getattr(error, 'strerror', error)}{suggest_file(path)}"
        raise BadValueError(path, "", problem) from error
    if not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode):
        raise BadValueError(path, "", "cannot be read: it is a device, a pipe or a socket, must be a file")
    if stat.S_ISREG(found.st_mode) and found.st_size > most:
        raise _complain(path, found.st_size, most)


def _complain(path: Path, size: int, most: int) -> BadValueError:
    return BadValueError(path, "", f"has {size / _MB:.3g} MB, must have at most {most / _MB:g} MB")


def read_yaml(path: Path) -> Any:
    """Parses a YAML file. Its content must be checked by ``files.data_model``.

    A file that cannot be read, is not YAML, repeats a key, or is too large raises a BadValueError.
    """
    return parse_yaml(read_text(path, SETTINGS), path)


def parse_yaml(text: str, source: Path | str) -> Any:
    """Parses YAML text, such as a command's argument. Errors are as in ``read_yaml``."""
    with _translate_yaml(source):
        return yaml.load(text, _Loader)


def check_yaml(path: Path) -> None:
    """Checks that a file is YAML. Tags of other programs are allowed. Otherwise a BadValueError is raised."""
    with _translate_yaml(path):
        yaml.compose(read_text(path, SETTINGS), _Loader)


@contextmanager
def _translate_yaml(path: Path | str) -> Iterator[None]:
    """Converts PyYAML's errors to BadValueError."""
    try:
        yield
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise BadValueError(path, where, f"is not YAML: {_QUOTED.sub(r'\1', str(error.problem))}") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not YAML: {_QUOTED.sub(r'\1', str(error))}") from error


class _Loader(yaml.SafeLoader):
    """Loader that parses numbers such as 1e-3 as in YAML 1.2. Repeated keys are rejected.

    PyYAML's C loader ends the process where brackets are nested very deep; this one raises a RecursionError.
    """

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            try:
                twice = key in seen
            except TypeError:  # keys that are lists or mappings; PyYAML rejects them below
                break
            if twice:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {show_value(key)} twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"), list("-+.0123456789")
)
