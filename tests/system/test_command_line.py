"""run_experiments.py as its users run it."""

import json
import os
import runpy
import signal
import sys
import time

import numpy as np
import pytest
from helpers.children import PATIENCE, ROOT
from helpers.same_results import list_differences

PROGRAM = ROOT / "run_experiments.py"
ROD = "  - {name: NAME, components: [{semi_axes: [SIZE, 0.015, 0.015], position: [SIZE, 0, 0], material: brass}]}\n"
FEW = (
    "tools:\n"
    + ROD.replace("NAME", "short").replace("SIZE", "0.05")
    + ROD.replace("NAME", "long").replace("SIZE", "0.1")
)
DECOY = ROD.replace("NAME", "decoy").replace("SIZE", "0.1").replace("brass", "beech, looks_like: brass")
FEW += DECOY


@pytest.fixture
def start(children):
    """Starts run_experiments.py with arguments as a process, where it is the process that is tested."""
    return lambda *arguments: children([sys.executable, str(PROGRAM), *map(str, arguments)])


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs it to its end in this process; returns its status, and what it wrote."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", [str(PROGRAM), *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(PROGRAM), run_name="__main__")
        return ended.value.code, *capsys.readouterr()

    return run


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--robot", "models"], "arm.dmd.yaml: "),
        (["--out", "file"], "is a file or is inside one, must be a folder"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_is_written(tmp_path, models, run, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (models / "arm.sdf").write_text("<sdf", encoding="utf-8")
    (tmp_path / "file").write_text("precious", encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    status, printed, err = run(*words)
    assert (status, printed, err.count("\n")) == (2, "", 1)
    assert said in err
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text(encoding="utf-8") == "precious"


def test_help_explains_every_option(run):
    status, out, _ = run("--help")
    assert status == 0
    for option in ("--repeats", "--seed", "--jobs", "--out", "--robot", "--vision", "--fault", "weight"):
        assert option in out


def wait_for(out, pattern):
    deadline = time.monotonic() + 240
    while not list(out.rglob(pattern)):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_interrupted_and_killed_run_resumes_to_the_same_numbers(tmp_path, models, start, run):
    """A run interrupted in its repeats and killed in its figures resumes (trust/kills.py kills at random moments).

    The rods are two, and the decoy.
    """
    interrupted, whole = tmp_path / "interrupted", tmp_path / "whole"
    (models / "tools" / "weight.yaml").write_text(FEW, encoding="utf-8")
    command = ("weight", "--repeats", 2, "--jobs", 1, "--robot", models)
    process = start(*command, "--out", interrupted)
    wait_for(interrupted, "repeat_*.npz")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "run_experiments.py: interrupted; the same command continues where it stopped"
    assert "Traceback" not in err

    process = start(*command, "--out", interrupted)
    wait_for(interrupted, "figure3.png")
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not (interrupted / "report.html").exists()

    for out in (interrupted, whole):
        status, printed, err = run(*command, "--out", out)
        assert status == 0, err
        assert "report.html" in printed
        assert (out / "report.html").exists()
    assert list_differences(whole, interrupted) == []


def test_files_that_differ_are_named(tmp_path):
    for name, metrics in (("one", {"a": 1, "wall_s": 2.0}), ("other", {"a": 1, "wall_s": 3.0})):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
        (folder / "figure.png").write_bytes(b"same")
        np.savez(folder / "repeat.npz", x=np.arange(3))
    one, other = tmp_path / "one", tmp_path / "other"
    assert list_differences(one, other) == []
    (other / "metrics.json").write_text(json.dumps({"a": 2, "wall_s": 2.0}), encoding="utf-8")
    (other / "figure.png").write_bytes(b"other")
    np.savez(other / "repeat.npz", x=np.arange(3) + 1e-16)
    (one / "more.txt").touch()
    assert list_differences(one, other) == ["figure.png", "metrics.json", "more.txt", "repeat.npz"]
