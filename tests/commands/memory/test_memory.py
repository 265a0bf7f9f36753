"""``affordance memory``: its output, and changes of the ledger, of which nothing else changes."""

import json
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest
from helpers.answers import answer
from helpers.refusals import refuse_command
from helpers.trials import WOOD, hold, hold_workshop

from affordance.extensions.memory.exchange import export_trials
from affordance.extensions.memory.ledger import open_memory


@pytest.fixture
def memory(tmp_path):
    path = tmp_path / "workshop.sqlite"
    with open_memory(path) as ledger:
        ledger.append(hold_workshop(9))
    return path


def test_show_prints_and_draws_materials_and_things(memory, tmp_path):
    text = answer("memory", "show", memory, "--out", tmp_path / "shown").out
    assert "9 trials" in text
    things = {"bar", "rod", "hammer"}
    assert {line.split()[0] for line in text.split("\n") if line.startswith(tuple(things))} == things
    assert "arm, other" in text
    assert (tmp_path / "shown" / "memory.png").stat().st_size > 1000
    content = json.loads((tmp_path / "shown" / "memory.json").read_text())
    assert answer("memory", "show", memory, "--json").content == content
    wood, steel = content["materials"]
    assert wood["interval90"][0] < 640.0 < wood["interval90"][1]
    assert steel["interval90"][0] < 7750.0 < steel["interval90"][1]
    assert wood["things"] == ["bar", "hammer"]
    assert wood["trials"] == 6
    assert wood["since"] == "2026-01-01T00:00:00.000000Z"
    bar, rod, hammer = content["things"]
    for thing, mass in ((bar, 0.6), (rod, 7.8), (hammer, 0.65 + 7.7)):
        assert abs(thing["mass"] - mass) < 3.0 * thing["mass_sd"]
        assert thing["trials"] == 3
    # A litre held three times is better known than its material, whose pieces differ by 0.06 of 640 kg/m^3.
    assert bar["mass_sd"] < 0.06 * 0.64 < (wood["interval90"][1] - wood["interval90"][0]) / 3.29 * 1e-3


def test_an_empty_memory_says_so(tmp_path):
    open_memory(tmp_path / "new.sqlite").close()
    assert "The memory is empty." in answer("memory", "show", tmp_path / "new.sqlite").out


def test_forget_merge_export_import_verify(memory, tmp_path):
    other, file = tmp_path / "other.sqlite", tmp_path / "trials.jsonl"
    with open_memory(other) as ledger:
        ledger.append([*hold_workshop(3), hold("plank", (WOOD,), (610.0,), 77)])
    assert "1 of 4 trials new, 10 in all" in answer("memory", "merge", memory, other).out
    answer("memory", "export", memory, file)
    answer("memory", "import", tmp_path / "again.sqlite", file)
    with open_memory(memory) as one, open_memory(tmp_path / "again.sqlite") as two:
        assert [trial.to_dict() for trial in one.list_trials()] == [trial.to_dict() for trial in two.list_trials()]
    assert "1 trial forgotten, 9 remain" in answer("memory", "forget", memory, "--object", "plank").out
    assert "9 trials, all sound" in answer("memory", "verify", memory).out
    assert answer("memory", "verify", memory, "--json").content == {"faults": [], "trials": 9}
    assert answer("memory", "merge", memory, other, "--json").content["trials"] >= 9
    assert answer("memory", "export", memory, tmp_path / "all.json", "--json").content["written"] >= 9


@pytest.mark.parametrize("action", ["merge", "import"])
def test_records_that_an_earlier_one_replaces_are_counted(memory, tmp_path, action):
    """The recording was read before with another size of the object."""
    trial = replace(hold("plank", (WOOD,), (610.0,), 77), source_hash="recording")
    before = replace(trial, time="2026-01-01", parts=(trial.parts[0]._replace(sizes=(0.06, 0.05, 0.05)),))
    other, file = tmp_path / "other.sqlite", tmp_path / "trials.jsonl"
    with open_memory(memory) as one, open_memory(other) as two:
        one.append([trial])
        two.append([before, *hold_workshop(10)])
        export_trials(two, file)
    given = {"merge": other, "import": file}[action]
    wanted = "1 of 11 trials new, 1 replaced by an earlier record, 11 in all"
    assert wanted in answer("memory", action, memory, given).out
    assert "0 of 11 trials new, 11 in all" in answer("memory", action, memory, given).out


def test_commands_that_are_refused_make_no_memory(memory, tmp_path):
    (tmp_path / "bad.jsonl").write_text("[]")
    shutil.copy(memory, tmp_path / "bad.sqlite")
    with closing(sqlite3.connect(tmp_path / "bad.sqlite", autocommit=True)) as connection:
        connection.execute("UPDATE trials SET content = 'nothing' WHERE object = 'hammer'")
    for words in (
        ("memory", "import", tmp_path / "new.sqlite", tmp_path / "bad.jsonl"),
        ("memory", "merge", tmp_path / "new.sqlite", memory, tmp_path / "bad.jsonl"),
        ("memory", "merge", tmp_path / "new.sqlite", memory, tmp_path / "bad.sqlite"),
        ("run", "vision", "--memory", f"sqlite:///{tmp_path / 'new.sqlite'}", "--out", tmp_path / "out"),
        ("run", "vision", "--memory", tmp_path / "new.sqlite", "--out", tmp_path / "out"),
    ):
        answer(*words, status=2)
        assert not list(tmp_path.glob("new.sqlite*"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("show nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("shwo workshop.sqlite", "did you mean 'show'"),
        ("show workshop.sqlite more", "show: is given the file 'more', must be given none"),
        ("show workshop.sqlite --object bar", "--object: has no effect on show"),
        ("show workshop.sqlite --set noise.sd=1", "--set: noise.sd"),
        ("show workshop.sqlite --same-colour red=blue", "--same-colour: is 'red=blue', must be two colours"),
        (
            "show workshop.sqlite --same-colour #b38050=#b07a45",
            "workshop.sqlite: same colours: name #b07a45, which no part in the memory has; the nearest is #b2804c",
        ),
        (
            "verify workshop.sqlite --same-colour #b38050=#b07a45",
            "--same-colour: has no effect on verify, must be given with show only",
        ),
        ("forget workshop.sqlite", "forget: selects no trials, must be given --robot, --object"),
        ("forget workshop.sqlite --since noon", "since: is 'noon', must be a time"),
        (
            "forget workshop.sqlite --robot arn",
            "--robot: is 'arn', must be one of arm, other; did you mean 'arm'",
        ),
        (
            "forget workshop.sqlite --robot arm --object hamer",
            "--object: is 'hamer', must be one of bar, hammer, rod; did you mean 'hammer'",
        ),
        ("merge workshop.sqlite", "merge: is given 0 files, must be given at least one memory"),
        ("merge workshop.sqlite nowhere.sqlite", "nowhere.sqlite: does not exist"),
        ("export workshop.sqlite a b", "export: is given 2 files, must be given one file"),
        ("import workshop.sqlite nowhere.jsonl", "nowhere.jsonl: cannot be read"),
    ],
)
def test_mistake_is_refused_and_changes_nothing(memory, monkeypatch, words, said):
    monkeypatch.chdir(memory.parent)
    assert said in refuse_command("memory", *words.split())


HEADER = '{"program": "visual-inertial-affordances", "schema": "2"}\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "given: is empty, must be an exported memory"),
        ("once upon a time", "given: is not an exported memory"),
        ('{"program": "x", "schema": "99"}', "given: line 1: schema: is '99' of 'x', must be '2'"),
        (
            HEADER.replace("2", "1"),
            "given: line 1: schema: is '1', must be '2': another version of the program wrote the memory",
        ),
        (HEADER + "{half\n", "given: line 2: is not JSON"),
    ],
)
def test_file_that_is_no_memory_is_not_imported(memory, monkeypatch, text, said):
    monkeypatch.chdir(memory.parent)
    (memory.parent / "given").write_text(text)
    assert said in refuse_command("memory", "import", "workshop.sqlite", "given")
