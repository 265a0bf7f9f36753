"""Finished runs of experiments, and the conditions that two of them must share to be compared."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from affordance.exceptions import AffordanceError, BadValueError
from affordance.files.bounded import read_json


@contextmanager
def blame_file(path: Path) -> Iterator[None]:
    """Blames a file of results for errors that its content causes.

    Raises:
        BadValueError: The content is not that of a finished run.
    """
    try:
        yield
    except AffordanceError:
        raise
    except Exception as error:  # a stranger's file may spoil anything
        raise BadValueError(path, "", f"is not what an experiment found ({error})") from error


def check_same_conditions(path: Path, one: Mapping[str, Any], other_path: Path, other: Mapping[str, Any]) -> None:
    """Refuses to compare runs under different conditions, which are entries of metrics.json, nested or not.

    Raises:
        BadValueError: The conditions differ; the message names the first that does.
    """
    left, right = dict(_flatten("", one)), dict(_flatten("", other))
    for name in sorted(left.keys() | right.keys()):
        if left.get(name) != right.get(name):
            problem = f"is {right.get(name)!r}, must be {left.get(name)!r} as in {path} to be compared with it"
            raise BadValueError(other_path, name, problem)


def read_numbers(path: Path) -> dict[str, Any]:
    """Reads a metrics.json.

    A file that cannot be read, or holds no mapping, raises a BadValueError.
    """
    with blame_file(path):
        return dict(read_json(path))


def _flatten(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yields the leaves of nested mappings, by dotted name."""
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, entry in value.items():
        yield from _flatten(f"{name}.{key}" if name else str(key), entry)
