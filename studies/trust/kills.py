"""Compares runs that are killed at random moments and then resumed with an undisturbed run."""

import contextlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

NUM_KILLS = 20
# Kills per run, after which the run may finish; a kill after the run's end is not counted.
_KILLS_PER_RUN = 2
# Keys of metrics.json that may differ between runs: times, and the setup with its folder and processes.
_OF_RUN = ("wall_s", "finished", "config")
# Pattern of a date in the report.
_DATE = re.compile(r"\b\d{4}-\d{2}-\d{2}\b")
# Runs to kill, used in turn.
RUNS = (
    ("weight", "--repeats", "3", "--jobs", "1"),
    ("com", "--repeats", "2", "--jobs", "2"),
    ("weight", "--repeats", "4", "--jobs", "2"),
)


def start(out: Path, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
    """Starts an experiment in a process group of its own."""
    command = [sys.executable, "-m", "affordance", *arguments, "--out", str(out)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def kill(process: subprocess.Popen[bytes]) -> bool:
    """Kills a process and its children; returns True if it was still running."""
    running = process.poll() is None
    if running:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return running


def list_differences(one: Path, other: Path) -> list[str]:
    """Lists the files that are not identical, byte for byte, in two folders of results.

    Times, dates and the setup are ignored in metrics.json and in the report. For .npz archives the arrays are
    compared, and time stamps are ignored.
    """
    files = {path.relative_to(folder) for folder in (one, other) for path in folder.rglob("*") if path.is_file()}
    return [str(name) for name in sorted(files) if not _are_same(one / name, other / name)]


def _are_same(one: Path, other: Path) -> bool:
    if not (one.exists() and other.exists()):
        return False
    if one.name == "metrics.json":
        first, second = (json.loads(path.read_text(encoding="utf-8")) for path in (one, other))
        return {**first, **dict.fromkeys(_OF_RUN)} == {**second, **dict.fromkeys(_OF_RUN)}
    if one.suffix == ".html":
        return _DATE.sub("", one.read_text(encoding="utf-8")) == _DATE.sub("", other.read_text(encoding="utf-8"))
    if one.suffix == ".npz":
        with np.load(one) as first, np.load(other) as second:
            return set(first) == set(second) and all(
                first[name].tobytes() == second[name].tobytes() and first[name].shape == second[name].shape
                for name in first
            )
    return one.read_bytes() == other.read_bytes()


def measure(*, kills: int = NUM_KILLS, seed: int = 0) -> tuple[list[list[str]], dict[str, Any]]:
    """Kills and resumes runs, and compares their results with those of an undisturbed run.

    Returns:
        A row for each run whose results differ, and numbers: counts, and ``kill_moments``, the times of kills for
        each experiment with its options, as fractions of the undisturbed run's duration.
    """
    rng = np.random.default_rng(seed)
    identical, failures = 0, []
    moments: dict[str, list[float]] = {" ".join(arguments): [] for arguments in RUNS}
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:

        def launch(out: Path, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
            """Starts a run that is killed when this study ends."""
            process = start(out, arguments)
            stack.callback(kill, process)
            return process

        whole, durations = {}, {}
        for number, arguments in enumerate(RUNS):
            whole[arguments] = Path(folder) / f"whole_{number}"
            begun = time.monotonic()
            launch(whole[arguments], arguments).wait()
            durations[arguments] = time.monotonic() - begun
        for run, arguments in enumerate(itertools.cycle(RUNS)):
            done = sum(map(len, moments.values()))
            if done >= kills:
                break
            out, killed = Path(folder) / f"run_{run}", []
            for _ in range(min(_KILLS_PER_RUN, kills - done)):
                process, moment = launch(out, arguments), rng.random()
                time.sleep(durations[arguments] * moment)
                if kill(process):
                    killed.append(moment)
            status = launch(out, arguments).wait()
            differences = list_differences(whole[arguments], out)
            moments[" ".join(arguments)] += killed
            if status == 0 and not differences:
                identical += len(killed)
            else:
                failures.append([f"run {run} ({' '.join(arguments)})", str(status), ", ".join(differences)])
    done = sum(map(len, moments.values()))
    return failures, {"kills": done, "kills_identical": identical, "kill_moments": moments}
