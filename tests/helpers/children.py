"""Processes that tests start: signals as at a terminal, and ended whatever becomes of the test."""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Time after which a child is ended, [s].
PATIENCE = 300.0

Start = Callable[..., subprocess.Popen[str]]


@contextmanager
def keep_children() -> Iterator[Start]:
    """Gives a function that starts processes, with the arguments of Popen, and ends at last all that are left.

    Each has a session of its own, so that those that it starts end with it. SIGINT interrupts it as at a terminal: a
    background job of a shell, and what ``nohup`` or some continuous integration starts, ignore it, and their children
    would inherit that.
    """
    children: list[subprocess.Popen[str]] = []

    def start(command: list[str], **options: object) -> subprocess.Popen[str]:
        before = signal.signal(signal.SIGINT, signal.SIG_DFL)
        try:
            pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "cwd": ROOT}
            child = subprocess.Popen(command, text=True, start_new_session=True, **{**pipes, **options})
        finally:
            signal.signal(signal.SIGINT, before)
        children.append(child)
        return child

    try:
        yield start
    finally:
        for child in children:
            end(child)


def end(child: subprocess.Popen[str]) -> None:
    """Kills a process and all of its session, and waits for it."""
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()
    for pipe in (child.stdout, child.stderr):
        if pipe is not None:
            pipe.close()
