"""Commands in an address space that is too small, and in processes that end: one line, no traceback and no crash."""

import os
import resource
import sys

import pytest
from helpers.children import PATIENCE, ROOT

GB = 1_000_000_000
COMMANDS = (
    ("doctor",),
    ("study",),
    ("rank", "hammer"),
    ("rank", "hammer", "--see", "pictures"),
    ("next", "hammer", "--samples", "100", "--only", "claw hammer"),
    ("excite", "--postures", "2"),
    ("identify", "--demo"),
    ("memory", "show", "none.sqlite"),
    ("predict", "weight", "--repeats", "2", "--jobs", "1"),
    ("run", "weight", "--repeats", "1", "--jobs", "1"),
    ("watch", "hammer", "--set", "prior.sd=x"),
)
# A task that takes all memory, or ends its process, in one of two processes.
TASKS = """
import os, signal, sys
import numpy as np
import affordance.cli
from affordance.runs.repeats import run_tasks

class Command:
    HELP = "a test's"
    def add_arguments(self, parser): pass
    def run(self, arguments): return len(run_tasks([dict, {task}], jobs=2, description="test"))

affordance.cli.load_command = lambda name: Command()
sys.exit(affordance.cli.main(["tutorials"]))
"""


@pytest.fixture
def ask(children, tmp_path):
    """Runs Python in a limited address space; returns its exit status and the lines of its standard error."""

    def ask(words, most):
        child = children(
            [sys.executable, *words],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (most, most)),
        )
        _, err = child.communicate(timeout=PATIENCE)
        return child.returncode, err.splitlines()

    return ask


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_command_in_a_small_address_space_ends_in_one_line(ask, words):
    status, lines = ask(["-m", "affordance", *words], GB)
    assert status in (0, 2), lines
    assert len(lines) == (status == 2 and words[0] != "doctor"), lines
    assert all(line.startswith("affordance: ") for line in lines)


@pytest.mark.parametrize(
    ("task", "said"),
    [
        ("lambda: np.ones(10**10)", "affordance: memory ran out (Unable to allocate 74.5 GiB"),
        (
            "lambda: os.kill(os.getpid(), signal.SIGKILL)",
            "affordance: a process ended unexpectedly, perhaps for lack of memory",
        ),
    ],
)
def test_process_of_a_command_that_lacks_memory_ends_it_in_one_line(ask, task, said):
    status, lines = ask(["-c", TASKS.format(task=task)], 4 * GB)
    assert status == 2
    assert len(lines) == 1
    assert lines[0].startswith(said)
