"""Reports errors in a user's program with the file and line where they occurred."""

import re
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from affordance.exceptions import AffordanceError, BadValueError


@contextmanager
def blame_program(path: Path) -> Iterator[None]:
    """Converts an error in a user's file to a BadValueError that names the line, even if another process raised it.

    If the error occurred outside the file, for example because of an argument that the file passed, the message also
    names this place.
    """
    try:
        yield
    except (AffordanceError, MemoryError):
        raise
    except Exception as error:
        where = _find_line(path.resolve(), error)
        what = f"{type(error).__name__}: {error}"
        if not where and (frames := traceback.extract_tb(error.__traceback__)):
            what += f" (in {Path(frames[-1].filename).name}, line {frames[-1].lineno})"
        raise BadValueError(path, where, what) from error


@contextmanager
def blame_programs(paths: Sequence[Path]) -> Iterator[None]:
    """Converts an error in any of several user files to a BadValueError that names file and line."""
    try:
        yield
    except (AffordanceError, MemoryError):
        raise
    except Exception as error:
        for path in paths:
            if where := _find_line(path.resolve(), error):
                raise BadValueError(path, where, f"{type(error).__name__}: {error}") from error
        raise


def _find_line(path: Path, error: BaseException) -> str:
    """Finds a file's innermost line in the traceback of an error; empty if the file is not in it."""
    frames = [
        (frame.lineno, frame.name)
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == str(path)
    ]
    if error.__cause__ is not None:  # from another process, whose traceback is a string
        pattern = rf'File "{re.escape(str(path))}", line (\d+), in (\S+)'
        frames += [(int(line), name) for line, name in re.findall(pattern, str(error.__cause__))]
    if not frames:
        return ""
    line, name = frames[-1]
    return f"line {line}" if name == "<module>" else f"line {line}, in {name}"
