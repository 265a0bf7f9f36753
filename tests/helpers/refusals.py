"""Calls and commands that must be refused in one line."""

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from affordance.exceptions import BadValueError
from helpers.answers import answer


def refuse(call: Callable[..., object], *arguments: object, error: type = BadValueError, **options: object) -> str:
    """Returns the message of the error, of one line, that a call with these arguments must raise."""
    with pytest.raises(error) as caught:
        call(*arguments, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def refuse_command(*words: object) -> str:
    """Returns the line that a refused command writes: exit status 2, and no file of the working folder changes."""
    with _leave_repository():
        before = _list_files()
        answered = answer(*words, status=2)
        assert (answered.out, answered.err.count("\n")) == ("", 1)
        assert _list_files() == before
    return answered.err.removesuffix("\n")


@contextlib.contextmanager
def _leave_repository() -> Iterator[None]:
    """Works in an empty folder where the test has none of its own: in the repository, other tests write files."""
    is_repository = Path("pyproject.toml").exists()
    with tempfile.TemporaryDirectory() as empty, contextlib.chdir(empty if is_repository else Path()):
        yield


def _list_files() -> dict[Path, int]:
    """Lists all files and folders, with the times at which they were written; 0 for folders."""
    return {path: path.stat().st_mtime_ns if path.is_file() else 0 for path in Path().rglob("*")}
