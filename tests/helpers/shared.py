"""Slow computations are made once, by the first of the processes that run tests and need them."""

import fcntl
import os
import pickle
from collections.abc import Callable
from pathlib import Path


def find_shared_folder(tmp_path_factory) -> Path:
    """Returns the temporary folder of all processes of this run."""
    folder: Path = tmp_path_factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


def compute_once[T](tmp_path_factory, name: str, compute: Callable[[], T]) -> T:
    """Returns what a function returns, kept by a name of its own; it is called by the first process that asks."""
    folder = find_shared_folder(tmp_path_factory)
    path = folder / f"{name}.pickle"
    with (folder / f"{name}.lock").open("w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.exists():
            path.write_bytes(pickle.dumps(compute()))
    found: T = pickle.loads(path.read_bytes())
    return found
