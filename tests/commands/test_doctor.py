"""``affordance doctor`` says its lines and nothing else."""

import sys

from helpers.children import PATIENCE


def test_only_its_own_lines_are_printed(children):
    """Meshcat's port and fontconfig's messages are not printed, and standard error stays empty."""
    child = children([sys.executable, "-m", "affordance", "doctor"])
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0
    assert err == ""
    lines = [line.split()[0] for line in out.splitlines()]
    assert lines[:6] == ["affordance", "libraries", "drake", "solvers", "renderer", "graphviz"]
    assert lines[6:] == ["meshcat", "models", "[cluster]", "[bags]"]
