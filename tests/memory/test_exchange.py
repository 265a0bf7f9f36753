"""Files of trials and memories of an earlier version: bounded, and refused in one line."""

import json

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.trials import WOOD, hold_workshop

from affordance.belief.density_belief import EMPTY_BELIEF, Prior
from affordance.belief.likelihood import Likelihood
from affordance.memory import exchange
from affordance.memory.exchange import export_trials, read_trials
from affordance.memory.ledger import open_memory

HEAD = {"program": "visual-inertial-affordances", "schema": "2"}


@pytest.fixture
def write(tmp_path):
    def write(*lines):
        path = tmp_path / "trials.jsonl"
        path.write_text("".join(f"{line if isinstance(line, str) else json.dumps(line)}\n" for line in lines))
        return path

    return write


def test_an_exported_memory_is_read_as_it_was(tmp_path):
    """Records have the form of version 0.3.0, which reads them too."""
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append(hold_workshop(5))
        assert export_trials(ledger, tmp_path / "trials.jsonl") == 5
        first, *_ = (tmp_path / "trials.jsonl").read_text().split("\n")
        assert json.loads(first) == HEAD
        found = read_trials(tmp_path / "trials.jsonl", Prior())
        assert [trial.to_dict() for trial in found] == [trial.to_dict() for trial in ledger.list_trials()]


def test_lines_and_files_are_bounded(write, monkeypatch):
    assert "line 3: has a record of more than 1 MB, must be smaller" in refuse(
        read_trials, write(HEAD, "", "x" * 1_000_001), Prior()
    )
    assert "has 1 MB, must have at most 1 MB" in refuse(read_trials, write("[" * 1_000_010), Prior())
    monkeypatch.setattr(exchange, "LARGEST_FILE", 100)
    assert "must have at most 0.0001 MB" in refuse(read_trials, write(HEAD, "x" * 200), Prior())


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
    assert message in refuse(read_trials, write(*lines), Prior())


def _remember(number, precision):
    belief = EMPTY_BELIEF.extend(Prior(), number)
    likelihood = Likelihood(precision * np.eye(number), np.zeros(number), 0.0)
    colours = tuple((i / number, 0.5, 0.5) for i in range(number))
    belief = belief.condition(likelihood)
    content = {"precision": belief.precision, "information_vector": belief.information_vector, "objects": []}
    return {"colours": list(colours), **{key: np.asarray(value).tolist() for key, value in content.items()}}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (_remember(3, 1e20), "features[0]: is 1e+20, must be from -1e+17 to 1e+17"),
        (_remember(40, 1.0) | {"taught_by": [str(i) for i in range(10_000)]}, "would need 16000000 numbers"),
        (_remember(2, 1.0) | {"taught_by": ["\x1b[2J"]}, "must be without the hidden character U+001B"),
        (_remember(2, 1.0) | {"taught_by": 3}, "taught_by: must be a list of texts"),
    ],
)
def test_memories_of_an_earlier_version_are_bounded(write, content, message):
    assert message in refuse(read_trials, write(content), Prior())


def test_the_name_of_an_earlier_memory_is_shown_and_short(tmp_path):
    path = tmp_path / ("\u202e" + "n" * 240)
    path.write_text(json.dumps(_remember(1, 1.0) | {"colours": [WOOD]}))
    (trial,) = read_trials(path, Prior())
    assert trial.object_name == f"memory of an earlier version: \ufffd{'n' * 240}"[:200]
    assert trial.source == f"\ufffd{'n' * 240}"
