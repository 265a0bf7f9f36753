"""Reads external files, with a size limit for each kind of file.

Sizes are checked before files are read. Each limit is much larger than usual files, and small enough that reading
takes at most a few minutes and gigabytes. Every fault raises an error with a one-line message.
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
# Tools, materials and other settings in YAML. The program's largest file has 8 kB.
SETTINGS = 1 * _MB
# Robot descriptions in XML, with meshes in separate files. A link takes a few kB.
ROBOT = 10 * _MB
# Meshes. A scan of 2 million triangles takes 100 MB in binary STL.
MESH = 200 * _MB
# Recordings. 15 minutes of seven joints at 1 kHz take 200 MB as text.
RECORDING = 200 * _MB
# Results of the program itself: memories, sections, metrics, summaries.
RESULTS = 100 * _MB
# Parts of a file that PyYAML quotes in error messages. They are removed, because the user may not be allowed to read
# the file.
_QUOTED = re.compile(r"(alias|anchor|tag|handle|base \d+:|to float:) '.*?'")
# Least similarity (difflib's ratio) of file names that differ by a typing error. One letter of seven gives 0.86.
_ALIKE = 0.8


def read_bytes(path: Path, most: int) -> bytes:
    """Reads a regular file of at most ``most`` bytes.

    Raises:
        BadValueError: The file is too large, is not a regular file, or cannot be read.
    """
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
    """Suggests the most similar file name in the same folder; empty if no name is similar."""
    try:
        files = (each for each in path.parent.iterdir() if _is_alike(path.stem, each.stem))
        return suggest(path.name, [each.name for each in files])
    except (OSError, ValueError):
        return ""


def _is_alike(one: str, other: str) -> bool:
    """Returns True if two names without suffixes differ by one or two typing errors."""
    return difflib.SequenceMatcher(None, one, other).ratio() >= _ALIKE


def read_text(path: Path, most: int, encoding: str = "utf-8") -> str:
    """Reads a text file of at most ``most`` bytes, and converts its line ends to newlines.

    Raises:
        BadValueError: The file cannot be read, is too large, or is not text in the given encoding.
    """
    try:
        text = read_bytes(path, most).decode(encoding)
    except UnicodeDecodeError as error:
        raise BadValueError(path, "", "is not a text file in UTF-8") from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: Path) -> Any:
    """Reads a JSON file.

    Raises:
        BadValueError: The file cannot be read, is too large, or is not JSON.
    """
    try:
        return json.loads(read_text(path, RESULTS))
    except (ValueError, RecursionError) as error:
        raise BadValueError(path, "", f"is not JSON: {error}") from error


def check_size(path: Path, most: int) -> None:
    """Checks that a file has at most ``most`` bytes.

    Raises:
        BadValueError: The file is larger, cannot be read, or is a device, a pipe or a socket.
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
    """Reads a YAML file. Its content must then be checked with ``files.data_model``.

    Raises:
        BadValueError: The file cannot be read, is too large, is not YAML, or repeats a key.
    """
    return parse_yaml(read_text(path, SETTINGS), path)


def parse_yaml(text: str, source: Path | str) -> Any:
    """Parses YAML text, such as a command's argument. Errors are the same as in ``read_yaml``."""
    with _translate_yaml(source):
        return yaml.load(text, _Loader)


def check_yaml(path: Path) -> None:
    """Checks that a file is YAML. Tags of other programs are allowed.

    Raises:
        BadValueError: The file cannot be read, is too large, or is not YAML.
    """
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
    """YAML loader that rejects repeated keys, and parses numbers such as 1e-3 as in YAML 1.2.

    For deeply nested brackets, PyYAML's C loader ends the process. This loader raises a RecursionError.
    """

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            try:
                twice = key in seen
            except TypeError:  # the key is a list or mapping, which PyYAML rejects below
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
