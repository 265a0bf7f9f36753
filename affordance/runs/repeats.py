"""Execution of repeats and other tasks in processes; completed repeats survive an interruption."""

import functools
import hashlib
import importlib.metadata
import inspect
import itertools
import json
import logging
import os
import platform
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
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
from affordance.runs.sources import describe_run
from affordance.version import __version__

_LOG = logging.getLogger(__name__)
_STAMP = "belongs_to"
# Errors that NumPy and zipfile raise for damaged archives (tests/system/test_bad_input.py damages many).
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
# Folders of the package that affect no number of a repeat: they only report.
_DECIDE_NOTHING = {"commands", "reporting"}
# Version of an installed library, whose folder of facts is read once, as that takes milliseconds.
_find_version = functools.cache(importlib.metadata.version)
_LIBRARIES = ("drake", "joblib", "matplotlib", "numpy", "opencv-python-headless", "scipy")


def check_folder(path: Path) -> None:
    """Raises a BadValueError for a folder that is a file, or is below one; it is not created."""
    if any(each.exists() and not each.is_dir() for each in (path, *path.parents)):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is or lies below a file, must be a folder")


def prepare_folder(path: Path) -> Path:
    """Creates a folder for results; raises a BadValueError if it is below a file, or not writable."""
    check_folder(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadValueError("--out", "", f"is {str(path)!r}, which cannot be made: {error.strerror}") from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is not writable")
    return path


def list_versions() -> dict[str, str]:
    """Lists the versions of the interpreter and of the libraries that results depend on."""
    versions = {name: _find_version(name) for name in _LIBRARIES}
    return {"affordance": __version__, "python": platform.python_version(), **versions}


def compute_key(
    config: Any,
    models: Path | Sequence[Path],
    *programs: Path,
    function: Callable[..., Any] | None = None,
    given: Sequence[Any] = (),
) -> str:
    """Computes a digest of everything that a repeat depends on: configuration, models, libraries and this program.

    It covers the program, except the folders that are used only for reporting; for a folder of models, the files
    that the program reads; for a configuration that is defined elsewhere, its package or the folder of its module;
    and any further folders of sources. Of a function that is run with given values, all counts that it reaches
    (``describe_run``). A change of
    anything else keeps the repeats.
    """
    digest = hashlib.sha256(json.dumps(to_plain(config), sort_keys=True, default=joblib.hash).encode())
    digest.update(json.dumps(list_versions()).encode())
    home = _find_home(type(config)) if is_dataclass(config) else _PACKAGE
    if not home.is_relative_to(_PACKAGE):
        programs = (home, *programs)
    named = [
        (str(path.relative_to(program)), path)
        for program in (_PACKAGE, *dict.fromkeys(programs))
        for path in sorted(program.rglob("*.py"))
        if program != _PACKAGE or path.relative_to(program).parts[0] not in _DECIDE_NOTHING
    ]
    if function is not None:
        reached, sources = describe_run(function, given, but=_PACKAGE)
        digest.update(reached.encode())
        named += [(path.name, path) for path in sources]
    if isinstance(models, Path):
        named += [(str(path.relative_to(models)), path) for path in list_model_files(models)]
    else:
        named += [(path.name, path) for path in models]
    for name, path in named:
        digest.update(name.encode())
        digest.update(read_bytes(path, MESH))
    return digest.hexdigest()[:16]


def _find_home(kind: type) -> Path:
    """Finds the folder of a class: that of its outermost package, or of its module if that is in none."""
    outermost = sys.modules[kind.__module__.partition(".")[0]]
    return Path(getattr(outermost, "__file__", None) or inspect.getfile(kind)).parent


def run_repeats(
    folder: Path,
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]],
    *,
    repeats: int,
    jobs: int,
    description: str,
    unit: str = "observer",
) -> dict[str, NDArray[Any]]:
    """Runs the repeats that a folder lacks, each on its own; see ``run_batches``."""
    run_batch = functools.partial(_run_each, run_repeat)
    return run_batches(folder, run_batch, repeats=repeats, jobs=jobs, description=description, unit=unit)


def run_batches(
    folder: Path,
    run_batch: Callable[[Sequence[int]], Sequence[Mapping[str, NDArray[Any]]]],
    *,
    repeats: int,
    jobs: int,
    description: str,
    unit: str = "observer",
    at_once: int = 1,
) -> dict[str, NDArray[Any]]:
    """Runs the repeats that a folder lacks in parallel processes, and returns all, stacked along the first axis.

    The folder, with one file per repeat, must belong to one configuration, and be named after its key. The function
    from the numbers of repeats, at most ``at_once``, to the named arrays of each must be picklable, and shapes the
    same for all repeats.

    Raises:
        AffordanceError: A repeat failed; the others are run and kept first, unless a part of the program cannot work
            on this machine.
    """
    kept = {repeat: arrays for repeat in range(repeats) if (arrays := _load(folder, repeat)) is not None}
    missing = [repeat for repeat in range(repeats) if repeat not in kept]
    size = max(1, min(at_once, -(-len(missing) // jobs)))
    batches = [missing[first : first + size] for first in range(0, len(missing), size)]
    failed: dict[int, AffordanceError] = {}
    parallel = joblib.Parallel(n_jobs=min(jobs, max(1, len(batches))), return_as="generator_unordered")
    ended = _report_ended(parallel(joblib.delayed(_run)(run_batch, batch) for batch in batches))
    with tqdm(total=repeats, initial=len(kept), desc=description, unit=unit, smoothing=0.1, disable=None) as progress:
        for repeat, arrays in itertools.chain.from_iterable(ended):
            if isinstance(arrays, UnavailableError):
                raise arrays
            if isinstance(arrays, AffordanceError):
                failed[repeat] = arrays
                continue
            # Here, not where it was run: another machine may not share this folder.
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
    """Runs tasks, picklable functions, in parallel processes, with a temporary progress bar on a terminal.

    Tasks run before anything is written, so that invalid input leaves nothing but a one-line error.
    """
    parallel = joblib.Parallel(n_jobs=min(jobs, max(1, len(tasks))), return_as="generator")
    results = _report_ended(parallel(joblib.delayed(task)() for task in tasks))
    return list(tqdm(results, total=len(tasks), desc=description, unit="task", leave=False, disable=None))


def _report_ended[T](results: Iterator[T]) -> Iterator[T]:
    """Yields the results of processes; if one ended before its task did, an AffordanceError says so in one line."""
    try:
        yield from results
    except BrokenExecutor as error:
        problem = "a process ended unexpectedly, as happens when memory runs out; fewer --jobs take less"
        raise AffordanceError(problem) from error


def end_processes() -> None:
    """Ends the worker processes, which joblib would keep for later repeats.

    They grow during another experiment; joblib takes that for a leak, replaces them, and warns.
    """
    get_reusable_executor().shutdown(wait=True)


def _run_each(
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]], repeats: Sequence[int]
) -> list[Mapping[str, NDArray[Any]]]:
    return [run_repeat(repeat) for repeat in repeats]


def _run(
    run_batch: Callable[[Sequence[int]], Sequence[Mapping[str, NDArray[Any]]]], repeats: Sequence[int]
) -> list[tuple[int, dict[str, NDArray[Any]] | AffordanceError]]:
    """Runs a batch of repeats, one by one if it failed; returns the error of a failed repeat."""
    try:
        return [(repeat, dict(arrays)) for repeat, arrays in zip(repeats, run_batch(repeats), strict=True)]
    except AffordanceError as error:
        if len(repeats) == 1:
            return [(repeats[0], error)]
        return [found for repeat in repeats for found in _run(run_batch, [repeat])]


def _keep(folder: Path, repeat: int, arrays: Mapping[str, NDArray[Any]]) -> None:
    stamped = {**arrays, _STAMP: np.array(_stamp_of(folder, repeat))}
    write_atomic(_path_of(folder, repeat), lambda temporary: np.savez(temporary, allow_pickle=False, **stamped))


def _load(folder: Path, repeat: int) -> dict[str, NDArray[Any]] | None:
    """Reads a kept repeat; None if it is missing, or if it is unreadable or foreign and was quarantined."""
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
    """Builds the stamp of a kept repeat, by which one from another folder is recognised."""
    return f"repeat {repeat} of {folder.name}"


def _path_of(folder: Path, repeat: int) -> Path:
    return folder / f"repeat_{repeat:05d}.npz"
