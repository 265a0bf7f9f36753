"""A Dask cluster on this machine: scheduler and workers are processes, started as in docs/howto/cluster.md."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from distributed import Client

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
