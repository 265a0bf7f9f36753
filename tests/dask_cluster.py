"""A Dask scheduler and its workers as processes of this machine, started as the README says."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np


class DaskCluster:
    """A running cluster; ``address`` is the scheduler's."""

    def __init__(self, folder, num_workers=2, num_threads=1):
        folder.mkdir(parents=True, exist_ok=True)
        self._file, self._log = folder / "scheduler.json", (folder / "log.txt").open("w")
        options = ["--no-dashboard", "--scheduler-file", self._file]
        self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", *options)
        threads = ["--nthreads", num_threads, "--no-nanny", "--local-directory", folder]
        self.workers = [self._start("worker", *threads, *options) for _ in range(num_workers)]
        deadline = time.monotonic() + 60
        while not self._file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]

    def _start(self, role, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{role}", *map(str, arguments)]
        # This folder too, as the function that tests send to the workers is in this module.
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parent)}
        return subprocess.Popen(command, stdout=self._log, stderr=self._log, env=environment)

    def stop(self):
        """Ends what is left of it."""
        for process in (*self.workers, self._scheduler):
            process.kill()
            process.wait()
        self._log.close()


def note_and_draw(folder, repeat):
    """A repeat that takes long enough for a worker to be killed in it, and notes where it ran."""
    (folder / f"{os.getpid()}_{repeat}").touch()
    time.sleep(0.3)
    return {"drawn": np.random.default_rng([5, repeat]).normal(size=3)}
