"""Experiments in the folder of examples run as their docstrings say, and find something."""

import json
import sys

import pandas as pd
import pytest
from helpers.answers import answer
from helpers.children import ROOT

from affordance.extensions.people.experiments import linear
from affordance.runs.program_file import load_program

FOLDER = ROOT / "examples" / "experiments"
FILES = sorted(path for path in FOLDER.glob("*.py") if path.stem != "counterbalanced")

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Few cycles of Linear+ and Linear++; the path is as it was."""
    monkeypatch.setattr(linear, "FAMILIAR", 3)
    monkeypatch.setattr(linear, "MIXED", 4)
    monkeypatch.setattr(sys, "path", [*sys.path])


# Constants with which designs that nobody has done run in seconds.
SHORTER = {
    "illusions": {"FAMILIAR": 2, "TESTED": 5},
    "ladder": {"DURATION": 0.1},
    "next_lift": {"SAMPLES": 100, "DURATION": 0.1, "TASKS": ("reach",)},
    "shallow_family": {"CYCLES": 16},
    "spoilt_family": {},
    "two_ends": {},
    "two_families": {"REPETITIONS": 4},
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # statistics of a single observer
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_experiment_runs_and_finds_what_it_asks_for(path, tmp_path, monkeypatch):
    for name, value in SHORTER.get(path.stem, {}).items():
        monkeypatch.setattr(load_program(path, "experiment"), name, value)
    if path.stem == "cycles_24_to_30":
        monkeypatch.setattr(linear, "FAMILIAR", 26)
    answer("run", path, "--repeats", 1 if path.stem in SHORTER else 2, "--jobs", 1, "--out", tmp_path)
    section = json.loads((tmp_path / path.stem / "section.json").read_text(encoding="utf-8"))
    assert section["finding"]
    assert "nan" not in section["finding"]


def test_replaced_participants_are_as_many_as_were_asked_for(tmp_path, monkeypatch):
    """Of observers who differ, those who have not learned are replaced by later ones; none is analysed for them."""
    path = FOLDER / "replaced_participants.py"
    answer("run", path, "--repeats", 8, "--jobs", 1, "--out", tmp_path)
    numbers = json.loads((tmp_path / path.stem / "metrics.json").read_text(encoding="utf-8"))
    lifts = pd.read_csv(tmp_path / path.stem / "lifts.csv")
    assert numbers["analysed"] == 8
    assert numbers["tested"] > 8
    third = lifts[(lifts["block"] == "family") & (lifts["cycle"] == 3)]
    error = ((third["force"] - third["weight"]).abs() / third["weight"]).groupby(third["observer"]).mean()
    assert (error <= 0.02).all()


def test_table_is_what_its_program_writes_and_is_lifted(tmp_path, monkeypatch):
    import runpy

    written = runpy.run_path(str(FOLDER / "counterbalanced.py"))
    table = written["build_table"](written["design"], 12, groups=["heavier", "lighter"])
    pd.testing.assert_frame_equal(table, pd.read_csv(FOLDER / "counterbalanced.csv"), check_dtype=False)
    words = ("--trials", FOLDER / "counterbalanced.csv", "--objects", FOLDER / "objects.yaml", "--out", tmp_path)
    means = answer("lift", *words, "--jobs", 1, "--learner", "density", "--json").content
    force = {each["group"]: each["force_N"] for each in means if each["phase"] == "test"}
    # Densities that decrease with the size differ more. Their scatter is a fraction of the mean density, so that one
    # which suits the densest can fits best; without that the mean density, 0.8 kg of the new can, would be lifted.
    assert force["heavier"] == pytest.approx(0.69 * 9.81, rel=0.05)
    assert force["lighter"] > 0.8 * 9.81
