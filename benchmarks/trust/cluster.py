"""An experiment sent to a cluster of two workers, one of which is killed in mid-run: are its files those of here?"""

import contextlib
import io
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any
from unittest import mock

from benchmarks.trust.dask_cluster import DaskCluster
from benchmarks.trust.kills import list_differences
from run_experiments import main

NUM_REPEATS = 8


def run(out: Path, *arguments: str) -> int:
    """Runs experiment ``weight``; returns the exit status."""
    command = ["run_experiments.py", "weight", "--repeats", str(NUM_REPEATS), "--out", str(out), *arguments]
    with mock.patch.object(sys, "argv", command), contextlib.redirect_stdout(io.StringIO()):
        return main()


def measure() -> tuple[list[list[str]], dict[str, Any]]:
    """Runs here and there; returns a row for each file that differs, and whether none does."""
    with tempfile.TemporaryDirectory() as folder:
        here, there = Path(folder) / "here", Path(folder) / "there"
        cluster = DaskCluster(Path(folder) / "cluster")
        victim = cluster.workers[0]

        def kill_in_mid_run() -> None:
            while not list(there.rglob("repeat_*.npz")) and victim.poll() is None:
                time.sleep(0.01)
            victim.kill()

        killer = threading.Thread(target=kill_in_mid_run, daemon=True)
        killer.start()
        try:
            status = run(there, "--cluster", cluster.address)
        finally:
            cluster.stop()
        killer.join()
        differences = list_differences(here, there) if status == run(here, "--jobs", "1") == 0 else ["exit status"]
    return [[name] for name in differences], {"cluster_identical": not differences}
