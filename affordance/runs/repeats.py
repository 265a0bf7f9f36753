"""Runs repeats and other tasks in parallel processes. Completed repeats survive an interruption."""

import functools
import hashlib
import importlib.metadata
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
from pathlib import Path
from types import ModuleType
from typing import Any

import cloudpickle
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
# Errors that NumPy and zipfile raise for damaged archives, as found by tests/system/test_bad_input.py.
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
# Folders of the package that cannot affect the numerical results of a repeat, because they only report.
_DECIDE_NOTHING = frozenset({"commands", "reporting"})
# Finds the version of an installed library. Reading its metadata takes milliseconds, so versions are cached.
_find_version = functools.cache(importlib.metadata.version)
_LIBRARIES = ("drake", "joblib", "matplotlib", "numpy", "opencv-python-headless", "scipy")


def check_folder(path: Path) -> None:
    """Checks that a folder can be created at a path, without creating it.

    Raises:
        BadValueError: The path is a file, or is inside a file.
    """
    if any(each.exists() and not each.is_dir() for each in (path, *path.parents)):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is a file or is inside one, must be a folder")


def prepare_folder(path: Path) -> Path:
    """Creates a results folder.

    Raises:
        BadValueError: The folder cannot be created or is not writable.
    """
    check_folder(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadValueError("--out", "", f"is {str(path)!r}, which cannot be created: {error.strerror}") from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise BadValueError("--out", "", f"is {str(path)!r}, which is not writable")
    return path


def list_versions() -> dict[str, str]:
    """Lists the versions of Python and of all libraries that can affect results."""
    versions = {name: _find_version(name) for name in _LIBRARIES}
    return {"affordance": __version__, "python": platform.python_version(), **versions}


def compute_key(inputs: Any, models: Path | Sequence[Path], *programs: Any) -> str:
    """Computes a digest of everything that can affect a repeat.

    Args:
        inputs: Configuration and arguments: dataclasses, numbers, texts, arrays, collections of these, functions (by
            their names), and any other object that can be pickled.
        models: Model folder, of which only the files that the program reads are included, or a list of files.
        programs: Functions, classes and objects that are run. For a user's program, all Python files in its folder or
            package are included; in a notebook, its code. This package's extensions are omitted if all programs
            belong to the paper, which imports no extension.
    """
    described = json.dumps(to_plain(inputs), sort_keys=True, default=_identify)
    digest = hashlib.sha256(f"{described} {list_versions()}".encode())
    modules = [_find_module(each) for each in programs]
    names = [module.__name__.split(".") for module in modules]
    of_paper = all(name[0] == "affordance" and name[1:2] != ["extensions"] for name in names)
    left_out = {*_DECIDE_NOTHING, "extensions"} if of_paper else _DECIDE_NOTHING
    named = [
        (str(path.relative_to(_PACKAGE)), path)
        for path in sorted(_PACKAGE.rglob("*.py"))
        if left_out.isdisjoint(path.relative_to(_PACKAGE).parts)
    ]
    for module in modules:
        outermost = sys.modules[module.__name__.partition(".")[0]]
        if (file := getattr(outermost, "__file__", None)) and (folder := Path(file).parent) != _PACKAGE:
            files = folder.rglob("*.py") if hasattr(outermost, "__path__") else folder.glob("*.py")
            named += [(str(path.relative_to(folder)), path) for path in sorted(files)]
    if isinstance(models, Path):
        named += [(str(path.relative_to(models)), path) for path in list_model_files(models)]
    else:
        named += [(path.name, path) for path in models]
    for name, path in named:
        digest.update(name.encode())
        digest.update(read_bytes(path, MESH))
    for each, module in zip(programs, modules, strict=True):
        if module.__name__ == "__main__" and not hasattr(module, "__file__"):
            digest.update(cloudpickle.dumps(each))
    return digest.hexdigest()[:16]


def _identify(value: Any) -> str:
    """Returns the name of a function or class, or a digest of any other object."""
    if hasattr(value, "__qualname__"):
        return f"{value.__module__}.{value.__qualname__}"
    digest: str = joblib.hash(value)
    return digest


def _find_module(program: Any) -> ModuleType:
    """Finds the module of a function, of a class, or of an object's class. Partial functions are allowed."""
    while isinstance(program, functools.partial):
        program = program.func
    return sys.modules[getattr(program, "__module__", type(program).__module__)]


def run_repeats(
    folder: Path,
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]],
    *,
    repeats: int,
    jobs: int,
    description: str,
) -> dict[str, NDArray[Any]]:
    """Runs the missing repeats of a folder without batches; see ``run_batches``."""
    run_batch = functools.partial(run_each, run_repeat)
    return stack_repeats(run_batches(folder, run_batch, repeats=repeats, jobs=jobs, description=description))


def stack_repeats(found: Sequence[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Stacks the arrays of all repeats along a new first axis. Arrays of the same name must have equal shapes."""
    return {name: np.stack([each[name] for each in found]) for name in found[0]}


def run_batches(
    folder: Path,
    run_batch: Callable[[Sequence[int]], Sequence[Mapping[str, NDArray[Any]]]],
    *,
    repeats: int,
    jobs: int,
    description: str,
    unit: str = "observer",
    at_once: int = 1,
) -> list[dict[str, NDArray[Any]]]:
    """Runs the missing repeats of a folder in parallel, and returns the named arrays of each repeat.

    Args:
        folder: Folder with one file per repeat. It must belong to a single configuration and be named after its key.
        run_batch: Function that runs at most ``at_once`` repeats, given their numbers, and returns the named arrays
            of each; it can be pickled.
        repeats: Number of repeats.
        jobs: Number of processes.
        description: Label of the progress bar.
        unit: Name of one repeat in the progress bar.
        at_once: Largest number of repeats in a batch.

    Raises:
        AffordanceError: A repeat failed. All other repeats are run and stored first, unless software that they need
            is missing on this machine.
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
            # This process stores the repeat, because the worker may be on a machine without this folder.
            _keep(folder, repeat, arrays)
            kept[repeat] = arrays
            progress.update()
    if failed:
        first = min(failed)
        if kept:
            _LOG.warning(
                "%s: %s %d of %d could not be run (%d failed in all); the results of the %d others are kept",
                description,
                unit,
                first,
                repeats,
                len(failed),
                len(kept),
            )
        raise failed[first]
    return [kept[repeat] for repeat in range(repeats)]


def run_tasks[T](tasks: Sequence[Callable[[], T]], *, jobs: int, description: str) -> list[T]:
    """Runs functions that can be pickled in parallel processes, with a temporary progress bar on a terminal.

    All tasks run before anything is written, so invalid input causes only a one-line error.
    """
    parallel = joblib.Parallel(n_jobs=min(jobs, max(1, len(tasks))), return_as="generator")
    results = _report_ended(parallel(joblib.delayed(task)() for task in tasks))
    return list(tqdm(results, total=len(tasks), desc=description, unit="task", leave=False, disable=None))


def _report_ended[T](results: Iterator[T]) -> Iterator[T]:
    """Yields the results of processes.

    Raises:
        AffordanceError: A process ended before its task was complete.
    """
    try:
        yield from results
    except BrokenExecutor as error:
        problem = "a process ended unexpectedly, perhaps for lack of memory; fewer --jobs need less memory"
        raise AffordanceError(problem) from error


def end_processes() -> None:
    """Ends the worker processes, which joblib would otherwise reuse for later repeats.

    In the next experiment, the memory of reused processes grows. joblib would treat this as a leak, replace the
    processes and warn.
    """
    get_reusable_executor().shutdown(wait=True)


def run_each(
    run_repeat: Callable[[int], Mapping[str, NDArray[Any]]], repeats: Sequence[int]
) -> list[Mapping[str, NDArray[Any]]]:
    """Runs the repeats of a batch one after the other."""
    return [run_repeat(repeat) for repeat in repeats]


def _run(
    run_batch: Callable[[Sequence[int]], Sequence[Mapping[str, NDArray[Any]]]], repeats: Sequence[int]
) -> list[tuple[int, dict[str, NDArray[Any]] | AffordanceError]]:
    """Runs a batch of repeats. If the batch fails, its repeats are run one by one.

    Returns:
        For each repeat, its number and either its arrays or its error.
    """
    try:
        return [(repeat, dict(arrays)) for repeat, arrays in zip(repeats, run_batch(repeats), strict=True)]
    except AffordanceError as error:
        if len(repeats) == 1:
            return [(repeats[0], error)]
        return [found for repeat in repeats for found in _run(run_batch, [repeat])]


def _keep(folder: Path, repeat: int, arrays: Mapping[str, NDArray[Any]]) -> None:
    stamped = {**arrays, _STAMP: np.array([_stamp_of(folder, repeat), _digest(arrays)])}
    write_atomic(_path_of(folder, repeat), lambda temporary: np.savez(temporary, allow_pickle=False, **stamped))


def _load(folder: Path, repeat: int) -> dict[str, NDArray[Any]] | None:
    """Loads a stored repeat; None if it is missing. An unreadable or foreign file is quarantined."""
    path = _path_of(folder, repeat)
    if path.exists() and not path.is_file():
        quarantine(path, "is no file")
        return None
    try:
        with path.open("rb") as file, np.lib.npyio.NpzFile(file, allow_pickle=False) as archive:
            arrays = dict(archive)
        stamp, content = map(str, arrays.pop(_STAMP))
    except FileNotFoundError:
        return None
    except _DAMAGE as error:
        quarantine(path, f"could not be read ({error})")
        return None
    if stamp != _stamp_of(folder, repeat):
        quarantine(path, f"belongs to {stamp}")
        return None
    if content != _digest(arrays):
        quarantine(path, "has other arrays than were stored")
        return None
    return arrays


def _digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Computes a digest of names, types, shapes and values, to detect changes of a stored repeat."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()[:16]


def _stamp_of(folder: Path, repeat: int) -> str:
    """Returns a text that identifies a repeat and its folder, to detect files from other folders."""
    return f"repeat {repeat} of {folder.name}"


def _path_of(folder: Path, repeat: int) -> Path:
    return folder / f"repeat_{repeat:05d}.npz"
