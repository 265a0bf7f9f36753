"""Running repeats and other tasks in processes; repeats that are done survive a kill."""

import hashlib
import importlib.metadata
import inspect
import json
import logging
import os
import platform
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from joblib.externals.loky import get_reusable_executor
from numpy.typing import NDArray
from tqdm import tqdm

from affordance.exceptions import AffordanceError, BadValueError, UnavailableError
from affordance.files.atomic import quarantine, to_plain, write_atomic
from affordance.files.bounded import MESH, read_bytes
from affordance.files.model_files import list_model_files
from affordance.version import __version__

_LOG = logging.getLogger(__name__)
_STAMP = "belongs_to"
# What NumPy and zipfile raise for archives that are damaged somewhere (tests/system/test_bad_input.py damages many).
_DAMAGE = (
    OSError,
    ValueError,
    TypeError,
    EOFError,
    LookupError,
    RuntimeError,
    MemoryError,
    SyntaxError,
    zlib.error,
    struct.error,
    zipfile.BadZipFile,
)
_PACKAGE = Path(__file__).parents[1]
# Folders of the package that decide no number of a repeat: they say and draw what was found.
_DECIDE_NOTHING = {"commands", "reporting"}
_LIBRARIES = ("drake", "joblib", "matplotlib", "numpy", "opencv-python-headless", "scipy")


def check_folder(path: Path) -> None:
    """Makes sure that a folder for results could be there, and makes nothing.

    Raises:
        BadValueError: The path is a file, or lies below one.
    """
    if any(each.exists() and not each.is_dir() for each in (path, *path.parents)):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is or lies below a file, must be a folder")


def prepare_folder(path: Path) -> Path:
    """Makes a folder for results, or makes sure that an existing one can be written to.

    Raises:
        BadValueError: The path is a file, lies below one, or may not be written to.
    """
    check_folder(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadValueError("--out", "", f"is {str(path)!r}, which cannot be made: {error.strerror}") from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is not writable")
    return path


def list_versions() -> dict[str, str]:
    """Versions of the interpreter and of the libraries that numbers depend on."""
    versions = {name: importlib.metadata.version(name) for name in _LIBRARIES}
    return {"affordance": __version__, "python": platform.python_version(), **versions}


def compute_key(config: Any, models: Path | Sequence[Path], *programs: Path) -> str:
    """Computes what a repeat depends on besides its number: configuration, models, libraries and this program.

    Of the program all counts but the folders that only report, of a folder of models what the program reads, and of a
    configuration defined elsewhere the folder of its module. A change of anything else keeps the repeats.

    Args:
        config: A dataclass.
        models: Files that are read, or a folder of models.
        programs: Folders of further sources that it depends on.

    Returns: A short hexadecimal key.
    """
    digest = hashlib.sha256(json.dumps(to_plain(config), sort_keys=True).encode())
    digest.update(json.dumps(list_versions()).encode())
    home = Path(inspect.getfile(type(config))).parent if is_dataclass(config) else _PACKAGE
    if not home.is_relative_to(_PACKAGE):
        programs = (home, *programs)
    named = [
        (str(path.relative_to(program)), path)
        for program in (_PACKAGE, *dict.fromkeys(programs))
        for path in sorted(program.rglob("*.py"))
        if path.relative_to(program).parts[0] not in _DECIDE_NOTHING
    ]
    if isinstance(models, Path):
        named += [(str(path.relative_to(models)), path) for path in list_model_files(models)]
    else:
        named += [(path.name, path) for path in models]
    for name, path in named:
        digest.update(name.encode())
        digest.update(read_bytes(path, MESH))
    return digest.hexdigest()[:16]


def run_repeats(
    folder: Path,
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]],
    *,
    repeats: int,
    jobs: int,
    description: str,
    unit: str = "observer",
) -> dict[str, NDArray[Any]]:
    """Runs the repeats that a folder does not hold yet, in parallel processes, and returns all of them.

    Args:
        folder: Keeps one file a repeat; it must belong to one configuration, and be named after its key.
        run_repeat: Runs the repeat of a number, returning named arrays of a shape that is always the same; must be
            picklable.
        repeats: How many, at least 1.
        jobs: How many processes, at least 1.
        description: Stands before the progress bar.
        unit: What a repeat is, for the progress bar.

    Returns: The arrays, stacked over repeats along the first axis.

    Raises:
        AffordanceError: A repeat failed; those that did not are run and kept first, unless it is a part of the
            program that does not work on this machine.
    """
    kept = {repeat: arrays for repeat in range(repeats) if (arrays := _load(folder, repeat)) is not None}
    missing = [repeat for repeat in range(repeats) if repeat not in kept]
    failed: dict[int, AffordanceError] = {}
    parallel = joblib.Parallel(n_jobs=min(jobs, max(1, len(missing))), return_as="generator_unordered")
    finished = parallel(joblib.delayed(_run)(run_repeat, repeat) for repeat in missing)
    with tqdm(total=repeats, initial=len(kept), desc=description, unit=unit, smoothing=0.1) as progress:
        for repeat, arrays in finished:
            if isinstance(arrays, UnavailableError):
                raise arrays
            if isinstance(arrays, AffordanceError):
                failed[repeat] = arrays
                continue
            # Here, not where it was run: another machine need not share this folder.
            _keep(folder, repeat, arrays)
            kept[repeat] = arrays
            progress.update()
    if failed:
        first = min(failed)
        if kept:
            _LOG.warning(
                "%s: %s %d of %d could not be run (%d in all); the %d others are kept",
                description,
                unit,
                first,
                repeats,
                len(failed),
                len(kept),
            )
        raise failed[first]
    return {name: np.stack([kept[repeat][name] for repeat in range(repeats)]) for name in kept[0]}


def run_tasks[T](tasks: Sequence[Callable[[], T]], *, jobs: int, description: str) -> list[T]:
    """Runs tasks in parallel processes, with a progress bar on a terminal that leaves nothing behind.

    Tasks come before anything is written: where one finds that the input is wrong, one line must say so.

    Args:
        tasks: Picklable functions with picklable results.
        jobs: How many processes, at least 1.
        description: Stands before the progress bar.

    Returns: The results, in the order of the tasks.
    """
    parallel = joblib.Parallel(n_jobs=min(jobs, max(1, len(tasks))), return_as="generator")
    results = parallel(joblib.delayed(task)() for task in tasks)
    return list(tqdm(results, total=len(tasks), desc=description, unit="task", leave=False, disable=None))


def end_processes() -> None:
    """Ends the processes that repeats ran in; joblib would keep them for the next ones.

    Those of another experiment grow in it, which joblib takes for a leak: it replaces them, and warns.
    """
    get_reusable_executor().shutdown(wait=True)


def _run(
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]], repeat: int
) -> tuple[int, dict[str, NDArray[Any]] | AffordanceError]:
    """Runs a repeat; returns the error of one that fails, so that others go on."""
    try:
        return repeat, dict(run_repeat(repeat))
    except AffordanceError as error:
        return repeat, error


def _keep(folder: Path, repeat: int, arrays: Mapping[str, NDArray[Any]]) -> None:
    stamped = {**arrays, _STAMP: np.array(_stamp_of(folder, repeat))}
    write_atomic(_path_of(folder, repeat), lambda temporary: np.savez(temporary, allow_pickle=False, **stamped))


def _load(folder: Path, repeat: int) -> dict[str, NDArray[Any]] | None:
    """Reads a kept repeat; None if there is none. One that cannot be read, or is another's, is quarantined."""
    path = _path_of(folder, repeat)
    try:
        with path.open("rb") as file, np.lib.npyio.NpzFile(file, allow_pickle=False) as archive:
            arrays = dict(archive)
        stamp = str(arrays.pop(_STAMP))
    except FileNotFoundError:
        return None
    except _DAMAGE as error:
        quarantine(path, f"could not be read ({error})")
        return None
    if stamp != _stamp_of(folder, repeat):
        quarantine(path, f"belongs to {stamp}")
        return None
    return arrays


def _stamp_of(folder: Path, repeat: int) -> str:
    """Says in a kept repeat whose it is, so that one from elsewhere is not taken for it."""
    return f"repeat {repeat} of {folder.name}"


def _path_of(folder: Path, repeat: int) -> Path:
    return folder / f"repeat_{repeat:05d}.npz"
