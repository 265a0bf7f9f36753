"""Compares a local run with a run on a Dask cluster on this machine, one of whose two workers is killed.

Scheduler and workers are processes, started as in docs/howto/cluster.md.
"""

import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from distributed import Client

from affordance.cli import main
from studies.trust.kills import list_differences

NUM_REPEATS = 8
PATIENCE = 60.0  # longest time to wait until a worker gets a task, [s]
# Longest time that processes may take to start on a busy machine, [s].
_START_PATIENCE = 120.0


class DaskCluster:
    """Running Dask cluster.

    Attributes:
        address: Address of the scheduler.
        workers: Processes of the workers.
    """

    def __init__(
        self, folder: Path, *, num_workers: int = 2, num_threads: int = 1, imports: Path | None = None
    ) -> None:
        """Starts the cluster, and waits for all its processes; they can also import modules from a given folder.

        Raises:
            TimeoutError: A process did not start in time; those that had started are ended.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self._file = folder / "scheduler.json"
        self._log = (folder / "log.txt").open("w", encoding="utf-8")
        self._environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        if imports is not None:
            self._environment["PYTHONPATH"] = str(imports)
        self._scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []
        options = ["--no-dashboard", "--scheduler-file", str(self._file)]
        threads = ["--nthreads", str(num_threads), "--no-nanny", "--local-directory", str(folder)]
        try:
            self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", *options)
            for _ in range(num_workers):
                self.workers.append(self._start("worker", *threads, *options))
            self.address = self._wait_for_scheduler()
            self._wait_for_workers(num_workers)
        except BaseException:  # after an interruption, too, no process may be left running
            self.stop()
            raise

    def _wait_for_scheduler(self) -> str:
        deadline = time.monotonic() + _START_PATIENCE
        while not (self._file.exists() and self._file.stat().st_size):  # the file is created before it is written
            if time.monotonic() > deadline:
                raise TimeoutError(f"no Dask scheduler after {_START_PATIENCE:g} s")
            time.sleep(0.05)
        return str(json.loads(self._file.read_text(encoding="utf-8"))["address"])

    def _wait_for_workers(self, num_workers: int) -> None:
        try:
            with self.connect() as client:
                if num_workers:
                    client.wait_for_workers(num_workers, timeout=_START_PATIENCE)
        except (TimeoutError, OSError) as error:
            raise TimeoutError(f"fewer than {num_workers} Dask workers after {_START_PATIENCE:g} s") from error

    def connect(self) -> Any:
        """Returns a client of the scheduler, which the caller must close."""
        return Client(self.address, timeout=_START_PATIENCE, set_as_default=False)

    def find_worker(self, process: subprocess.Popen[bytes]) -> str:
        """Returns the address under which the scheduler knows a worker."""
        with self.connect() as client:
            pids: dict[str, int] = client.run(os.getpid)
        return next(address for address, pid in pids.items() if pid == process.pid)

    def _start(self, role: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *arguments]
        return subprocess.Popen(command, stdout=self._log, stderr=self._log, env=self._environment)

    def stop(self) -> None:
        """Ends all remaining processes."""
        for process in (*self.workers, *([self._scheduler] if self._scheduler else [])):
            process.kill()
            process.wait()
        self._log.close()


def run(out: Path, *arguments: str) -> int:
    """Runs experiment ``weight``; returns the exit status."""
    with contextlib.redirect_stdout(io.StringIO()):
        return main(["weight", "--repeats", str(NUM_REPEATS), "--out", str(out), *arguments])


def kill_while_busy(cluster: DaskCluster, victim: subprocess.Popen[bytes], has_begun: Callable[[], bool]) -> bool:
    """Kills a worker as soon as a run has begun and the worker has a task; returns True if it had a task.

    If the run ends earlier, the worker gets no task, and the wait ends after PATIENCE.
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
    """Runs locally and on the cluster.

    If the worker had no task when it was killed, the comparison proves nothing; this counts as a difference.

    Returns:
        A row for each file that differs, and whether all files are equal.
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
