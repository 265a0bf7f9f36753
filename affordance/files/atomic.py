"""Writes files atomically: a file is either complete or does not exist."""

import json
import logging
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

_LOG = logging.getLogger(__name__)
_TEMPORARY = ".writing."


def write_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Writes a file by calling ``write`` with a temporary path, and then renames it to the target.

    Missing folders are created. The temporary file has the same suffix as the target. An OSError names the target
    instead of the temporary file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{_TEMPORARY}{os.getpid()}.{path.name}")
    try:
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        if error.filename is not None and Path(error.filename) != temporary:
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        with suppress(OSError):  # for example in a read-only folder, for which the first error is being raised
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a text file atomically."""
    write_atomic(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Writes a JSON file atomically, with numbers in full precision."""
    write_text(path, json.dumps(to_plain(content), indent=2, allow_nan=False) + "\n")


def to_plain(value: Any) -> Any:
    """Converts dataclasses, arrays and other values to JSON types. Fields marked ``reports`` are omitted."""
    if is_dataclass(value) and not isinstance(value, type):
        kept = (each.name for each in fields(value) if not each.metadata.get("reports"))
        return {name: to_plain(getattr(value, name)) for name in kept}
    if hasattr(value, "to_plain"):
        return to_plain(value.to_plain())
    if hasattr(value, "model_dump"):
        return to_plain(value.model_dump())
    if hasattr(value, "_asdict"):
        return to_plain(value._asdict())
    if isinstance(value, Mapping):
        return {str(key): to_plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [to_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        return value.item()
    if hasattr(value, "value") and hasattr(value, "name"):  # a member of an Enum
        return value.value
    if isinstance(value, Path):
        return value.name
    return value


def remove_leftovers(folder: Path) -> None:
    """Removes temporary files of an interrupted run. No other run may use the folder at the same time."""
    for path in folder.rglob(f"{_TEMPORARY}*"):
        path.unlink(missing_ok=True)


def quarantine(path: Path, problem: str) -> None:
    """Renames a corrupt or foreign file or folder to *.broken, and logs a warning. An older *.broken is replaced."""
    aside = path.with_suffix(".broken")
    if aside.is_dir():
        shutil.rmtree(aside)
    path.replace(aside)
    _LOG.warning("%s %s; set aside as %s", path, " ".join(problem.split()), aside.name)
