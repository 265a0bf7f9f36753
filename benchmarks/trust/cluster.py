"""Comparison of a local run with one on a cluster of two workers, one of which is killed during the run."""

import contextlib
import io
import subprocess
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from affordance.cli import main
from benchmarks.trust.dask_cluster import DaskCluster
from benchmarks.trust.kills import list_differences

NUM_REPEATS = 8
PATIENCE = 60.0  # for a worker that gets no task, [s]


def run(out: Path, *arguments: str) -> int:
    """Runs experiment ``weight``; returns the exit status."""
    with contextlib.redirect_stdout(io.StringIO()):
        return main(["weight", "--repeats", str(NUM_REPEATS), "--out", str(out), *arguments])


def kill_while_busy(cluster: DaskCluster, victim: subprocess.Popen[bytes], has_begun: Callable[[], bool]) -> bool:
    """Kills a worker as soon as a run has begun and the worker has a task; returns True if it had one.

    It has none if the run ends first: the scheduler gives it no further task, and patience ends.
    """
    address = cluster.find_worker(victim)
    deadline = time.monotonic() + PATIENCE
    busy = False
    with cluster.connect() as client:
        while not busy and time.monotonic() < deadline:
            time.sleep(0.01)
            busy = has_begun() and bool(client.processing([address])[address])
        victim.kill()
    return busy


def measure() -> tuple[list[list[str]], dict[str, Any]]:
    """Runs locally and on the cluster; returns a row for each file that differs, and True if none does.

    A victim without a task when it was killed proves nothing, and counts as a difference.
    """
    with tempfile.TemporaryDirectory() as folder:
        here, there = Path(folder) / "here", Path(folder) / "there"
        cluster = DaskCluster(Path(folder) / "cluster")

        def has_begun() -> bool:
            return any(there.rglob("repeat_*.npz"))

        with ThreadPoolExecutor(1) as pool:
            try:
                killed = pool.submit(kill_while_busy, cluster, cluster.workers[0], has_begun)
                status = run(there, "--cluster", cluster.address)
                was_busy = killed.result()
            finally:
                cluster.stop()
        differences = list_differences(here, there) if status == run(here, "--jobs", "1") == 0 else ["exit status"]
        if not was_busy:
            differences.append("the worker had no task when it was killed")
    return [[name] for name in differences], {"cluster_identical": not differences}
