"""The one runner, with a made-up experiment: its calls, its files and its messages."""

import dataclasses
import json
import os
from pathlib import Path

import numpy as np
import pytest
from helpers.results_files import read_numbers
from matplotlib.figure import Figure

from affordance.exceptions import UnavailableError
from affordance.experiments.definition import Experiment, Outputs
from affordance.experiments.runner import describe_faults, describe_few_observers, run_experiment
from affordance.files.netcdf import LabelledArray, Trajectories
from affordance.proprioception.faults import NO_FAULTS, Faults
from affordance.reporting.report import write_report
from affordance.settings import DEFAULT_SETTINGS, Settings

SECTION = """
order: 1
title: "Made up"
summary: "{{ repeats | observers }}, seed {{ seed }}, planned: {{ planned }}."
figures:
  - {file: line.png, caption: "A line."}
  - {file: diagram.svg, caption: "The Diagram."}
claims:
  - key: even
    source: ours
    text: The mean is small.
    criteria:
      - {name: mean, value: mean, at_most: 1}
remarks:
  - "{{ few_observers }}"
  - "{{ faults }}"
"""


@dataclasses.dataclass(frozen=True)
class MadeUp(Experiment):
    """An experiment in which observers draw a number."""

    section: Path
    seed: int = 3
    settings: Settings = DEFAULT_SETTINGS
    outliers: tuple[int, ...] = (0, 0)

    name = "made_up"
    unit = "draw"

    def count_repeats(self, observers):
        return 2 * observers

    def gain_experience(self, folder, *, repeats, jobs):
        assert folder.name == "experience"

    def select_shared(self, plan):
        return f"{plan} selected"

    def run_observer(self, shared, experience, repeat):
        assert shared == "plan selected"
        return {"drawn": np.random.default_rng([self.seed, repeat]).random(3)}

    def compute_metrics(self, plan, experience, arrays):
        return {
            "mean": arrays["drawn"].mean(),
            "count": len(arrays["drawn"]),
            "samples_rejected": np.zeros(2, dtype=int),
            "trials_outlier": np.array(self.outliers),
        }

    def list_facts(self, plan, numbers):
        return {"planned": plan}

    def show(self, plan, experience, arrays, numbers):
        def draw():
            figure = Figure()
            figure.subplots().plot(arrays["drawn"][0])
            return figure

        def fail():
            raise UnavailableError("pictures of Diagrams are", "libnothing.so is missing")

        drawn = LabelledArray(("repeat", "place"), arrays["drawn"], "1", "what was drawn")
        return Outputs(
            figures={"line": draw},
            trajectories=Trajectories({"drawn": drawn}, {}),
            diagram=fail,
            replay=lambda path: path.write_text("a replay", encoding="utf-8"),
            writers={"note": lambda folder: (folder / "note.txt").write_text("noted", encoding="utf-8")},
        )


@pytest.fixture
def experiment(tmp_path):
    section = tmp_path / "made_up.yaml"
    section.write_text(SECTION, encoding="utf-8")
    return MadeUp(section)


def run(experiment, out, repeats=4):
    run_experiment(experiment, "plan", out / experiment.name, repeats=repeats, jobs=1)
    return read_numbers(out / experiment.name)


def test_everything_is_written_by_its_name_and_numbers_come_last(experiment, tmp_path, monkeypatch):
    written = []
    replace = os.replace
    monkeypatch.setattr(
        Path, "replace", lambda self, target: written.append(Path(target).name) or replace(self, target)
    )
    numbers = run(experiment, tmp_path)
    folder = tmp_path / "made_up"
    files = {path.name for path in folder.iterdir() if path.is_file()}
    expected = {"line.png", "line.svg", "trajectories.nc", "replay.html", "note.txt", "section.json", "metrics.json"}
    assert files == expected
    assert written[-1] == "metrics.json"
    assert (numbers["count"], numbers["seed"], numbers["repeats"], numbers["run_shown"]) == (8, 3, 4, 0)
    assert numbers["config"]["seed"] == 3
    assert numbers["versions"].keys() >= {"affordance", "drake", "numpy"}
    assert numbers["wall_s"] > 0.0
    expected = np.mean([np.random.default_rng([3, repeat]).random(3) for repeat in range(8)])
    assert numbers["mean"] == pytest.approx(expected)


def test_repeats_are_kept_and_everything_else_is_written_anew(experiment, tmp_path):
    first = run(experiment, tmp_path, repeats=2)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("repeat_*.npz")}
    assert len(kept) == 4
    (tmp_path / "made_up" / "line.png").unlink()
    again = run(experiment, tmp_path, repeats=2)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("repeat_*.npz")} == kept
    assert {**again, "wall_s": 0.0} == {**first, "wall_s": 0.0}
    assert (tmp_path / "made_up" / "line.png").exists()
    other = dataclasses.replace(experiment, seed=4)
    assert run(other, tmp_path, repeats=2)["mean"] != first["mean"]
    assert len(list(tmp_path.rglob("repeat_*.npz"))) == 8


def test_what_is_unavailable_is_left_out_in_one_line_and_the_rest_is_there(experiment, tmp_path, caplog):
    run(experiment, tmp_path)
    (line,) = caplog.messages
    assert line.startswith("made_up: diagram is left out: pictures of Diagrams are")
    assert "libnothing.so is missing" in line
    assert "\n" not in line
    section = json.loads((tmp_path / "made_up" / "section.json").read_text(encoding="utf-8"))
    assert [figure["file"] for figure in section["figures"]] == ["line.png"]
    assert "<h2>Made up</h2>" in write_report(tmp_path).read_text(encoding="utf-8")


def test_section_is_filled_in_with_numbers_and_facts(experiment, tmp_path):
    run(experiment, tmp_path)
    section = json.loads((tmp_path / "made_up" / "section.json").read_text(encoding="utf-8"))
    assert section["summary"] == "4 observers, seed 3, planned: plan."
    assert section["claims"][0]["met"] is True
    assert section["remarks"] == ["Only 4 observers: claims need about 20 or more."]


@pytest.mark.parametrize(("outliers", "said"), [((0, 5), False), ((2, 5), True)])
def test_outliers_are_warned_of_but_for_the_decoy_which_comes_last(experiment, tmp_path, caplog, outliers, said):
    run(dataclasses.replace(experiment, outliers=outliers), tmp_path)
    message = "made_up: 0 samples were rejected, and 2 trials with non-decoy objects are 5-sigma outliers"
    assert (message in caplog.text) == said


def test_faults_are_named_by_what_differs_from_none():
    assert describe_faults(NO_FAULTS) == ""
    said = describe_faults(Faults(stuck_joint="elbow", stuck_torque=-3.0, delay_samples=1))
    assert said.startswith(
        "Run with faults: stuck_joint elbow, stuck_torque -3.0, delay_samples 1. The true cost of a task"
    )


@pytest.mark.parametrize(("repeats", "few"), [(1, True), (19, True), (20, False), (1000, False)])
def test_few_observers_are_warned_of(repeats, few):
    assert bool(describe_few_observers(repeats)) == few
