"""``affordance doctor`` says its lines and nothing else."""

import os
import sys
import tomllib

import pytest
from helpers.children import PATIENCE, ROOT

from affordance.commands.doctor import EXTRAS


def test_only_its_own_lines_are_printed(children):
    """Meshcat's port and fontconfig's messages are not printed, and standard error stays empty."""
    child = children([sys.executable, "-m", "affordance", "doctor"])
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0
    assert err == ""
    lines = [line.split()[0] for line in out.splitlines()]
    assert lines[:6] == ["affordance", "libraries", "drake", "solvers", "renderer", "graphviz"]
    assert lines[6:8] == ["meshcat", "models"]
    assert lines[8:] == [f"[{extra}]" for extra in EXTRAS]
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert {*EXTRAS} == {*extras} - {"dev", "docs", "peers", "release"}


@pytest.fixture
def without_drake(tmp_path):
    """An environment in which Drake cannot be imported."""
    (tmp_path / "pydrake").mkdir()
    (tmp_path / "pydrake" / "__init__.py").write_text('raise ImportError("no Drake here")', encoding="utf-8")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}


def test_without_drake_it_says_what_does_not_work(children, without_drake):
    child = children([sys.executable, "-m", "affordance", "doctor"], env=without_drake)
    out, err = child.communicate(timeout=PATIENCE)
    assert (child.returncode, err) == (2, "")
    assert "drake       does not work: no Drake here\n" in out
    assert out.splitlines()[-1].startswith("[film]")


@pytest.mark.parametrize("words", [["study", "people"], ["run", "weight"]])
def test_without_drake_other_commands_say_it_in_one_line(children, without_drake, words, tmp_path):
    child = children([sys.executable, "-m", "affordance", *words], env=without_drake, cwd=tmp_path)
    out, err = child.communicate(timeout=PATIENCE)
    said = "affordance: a library cannot be loaded (no Drake here); affordance doctor says what works here\n"
    assert (child.returncode, out, err) == (2, "", said)
