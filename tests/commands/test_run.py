"""The command that runs experiments."""

from pathlib import Path

import pytest
from helpers.answers import answer

from affordance.commands import run
from affordance.experiments.suite import SuiteResult


@pytest.mark.parametrize(("left_out", "status"), [({}, 0), ({"hammer": "no swing is so fast"}, 3)])
def test_exit_status_says_whether_all_could_be_done(left_out, status, monkeypatch, tmp_path):
    monkeypatch.setattr(run, "run_suite", lambda *_, **__: SuiteResult(Path("results/report.html"), left_out))
    printed = answer("run", "all", "--repeats", 1, "--out", tmp_path, status=status)
    assert printed.out == "The report: results/report.html\n"
    assert ("hammer" in printed.err) == bool(left_out)
