"""Children of the suite do not inherit signals ignored by its starter, and none outlives its test."""

import os
import signal
import sys
import time

import psutil
import pytest
from helpers.children import keep_children

SHOW = "import signal; print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)"
# A child with a child of its own, both of which would sleep for an hour.
SLEEP = """
import subprocess
child = subprocess.Popen(["sleep", "3600"])
print(child.pid, flush=True)
child.wait()
"""


@pytest.fixture
def ignored():
    """SIGINT as under nohup, or in a background job of a shell that is not interactive."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


def test_children_are_interrupted_as_at_a_terminal_however_the_suite_was_started(children, ignored):
    out, _ = children([sys.executable, "-c", SHOW]).communicate(timeout=60)
    assert out.strip() == "True"
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # the suite's own handler is unchanged


def test_children_and_their_children_are_ended_if_a_test_fails():
    started = []

    def fail():
        with keep_children() as start:
            started.append(start([sys.executable, "-c", SLEEP]))
            started.append(int(started[0].stdout.readline()))
            assert psutil.pid_exists(started[1])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    child, grandchild = started
    assert child.returncode == -signal.SIGKILL
    deadline = time.monotonic() + 10
    while psutil.pid_exists(grandchild) and psutil.Process(grandchild).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_group_of_a_child_is_not_that_of_the_suite(children):
    child = children(["sleep", "3600"])
    assert os.getpgid(child.pid) != os.getpgid(0)
