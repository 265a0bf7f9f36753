"""The command that runs experiments."""

import json
from pathlib import Path

import pytest
from helpers.answers import answer

from affordance.commands import run
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import OF_THE_PAPER, SuiteResult


@pytest.mark.parametrize(("left_out", "status"), [({}, 0), ({"hammer": "no swing is so fast"}, 3)])
def test_exit_status_says_whether_all_could_be_done(left_out, status, monkeypatch, tmp_path):
    def run_suite(experiments, setup, *, begin, **_):
        begin(list(experiments))
        return SuiteResult(Path("results/report.html"), left_out, {"weight": "the decoy rises"})

    monkeypatch.setattr(run, "run_suite", run_suite)
    printed = answer("run", "all", "--repeats", 1, "--out", tmp_path, status=status)
    plan, finding, report = printed.lines
    assert plan.startswith("weight, com, reach, hammer: 1 observer each, ")
    assert finding == "weight: the decoy rises"
    assert report == "The report: results/report.html"
    assert ("hammer" in printed.err) == bool(left_out)
    said = answer("run", "--repeats", 1, "--out", tmp_path, "--json", status=status)
    assert said.content["left_out"] == left_out
    assert list(said.content["numbers"]) == [name for name in OF_THE_PAPER if name not in left_out]
    assert said.content["report"] == "results/report.html"
    assert plan in said.err


def test_plan_of_a_run_is_estimated_from_earlier_runs(tmp_path):
    setup = Setup(observers=100, jobs=2, out=tmp_path)
    plan = run.describe_plan(["weight", "com"], setup)
    assert plan.startswith(f"weight, com: 100 observers each, 2 at a time, into {tmp_path}/. No earlier run")
    for name, wall, jobs in (("weight", 30.0, 4), ("com", 100.0, 1)):
        (tmp_path / name).mkdir()
        numbers = {"repeats": 50, "wall_s": wall, "config": {"jobs": jobs}}
        (tmp_path / name / "metrics.json").write_text(json.dumps(numbers))
    # Twice the observers: 30 s of 4 processes are 120 s of 2, and 100 s of 1 are 100 s.
    assert "it takes about 4 min." in run.describe_plan(["weight", "com"], setup)
    assert "takes about 2 min, not counting reach (no earlier run)." in run.describe_plan(["weight", "reach"], setup)


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{}",
        "nonsense",
        '{"repeats": 0, "wall_s": 1, "config": {"jobs": 1}}',
        '{"repeats": 5, "wall_s": "x", "config": {"jobs": 1}}',
        '{"repeats": 5, "wall_s": 1, "config": 7}',
    ],
)
def test_damaged_numbers_of_an_earlier_run_are_no_estimate(tmp_path, text):
    (tmp_path / "weight").mkdir()
    (tmp_path / "weight" / "metrics.json").write_text(text)
    assert "No earlier run" in run.describe_plan(["weight"], Setup(out=tmp_path))
