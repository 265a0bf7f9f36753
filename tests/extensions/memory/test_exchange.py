"""Files of trials: bounded, and refused in one line."""

import json

import pytest
from helpers.refusals import refuse
from helpers.trials import hold_workshop

from affordance.extensions.memory import exchange
from affordance.extensions.memory.exchange import export_trials, read_trials
from affordance.extensions.memory.ledger import open_memory

HEAD = {"program": "visual-inertial-affordances", "schema": "2"}


@pytest.fixture
def write(tmp_path):
    def write(*lines):
        path = tmp_path / "trials.jsonl"
        path.write_text("".join(f"{line if isinstance(line, str) else json.dumps(line)}\n" for line in lines))
        return path

    return write


def test_an_exported_memory_is_read_as_it_was(tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append(hold_workshop(5))
        assert export_trials(ledger, tmp_path / "trials.jsonl") == 5
        first, *_ = (tmp_path / "trials.jsonl").read_text().split("\n")
        assert json.loads(first) == HEAD
        found = read_trials(tmp_path / "trials.jsonl")
        assert [trial.to_dict() for trial in found] == [trial.to_dict() for trial in ledger.list_trials()]


def test_lines_and_files_are_bounded(write, monkeypatch):
    assert "line 3: has a record of more than 1 MB, must be smaller" in refuse(
        read_trials, write(HEAD, "", "x" * 1_000_001)
    )
    monkeypatch.setattr(exchange, "LARGEST_FILE", 100)
    assert "must have at most 0.0001 MB" in refuse(read_trials, write(HEAD, "x" * 200))


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEAD, "[" * 100_000), "line 2: is not JSON: "),
        ((HEAD, "9" * 10_000), "line 2: is not JSON: "),
        ((HEAD, "NaN"), "line 2: is nan, must be a mapping of keys to values"),
        ((HEAD, {}), "line 2.id: is missing"),
        (({"schema": ["2"], "program": HEAD["program"]},), "line 1: schema: is ['2'], must be '2': another version"),
        (({"schema": "2", "program": {"a": 1}},), "line 1: schema: is '2' of {'a': 1}, must be '2' of "),
    ],
)
def test_lines_that_are_no_records_are_refused(write, lines, message):
    assert message in refuse(read_trials, write(*lines))
