"""The ledger: a trial that is appended is kept once, and beliefs do not depend on the order of trials."""

import copy
import itertools
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.trials import BRASS, STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.belief.learners import KINDS_MAP, LEARNERS
from affordance.belief.likelihood import Quadratic
from affordance.belief.material_memory import start_memory
from affordance.exceptions import AffordanceError, BadArgumentError, BadValueError
from affordance.extensions.memory import ledger as module
from affordance.extensions.memory.ledger import (
    Selection,
    count_past_arms,
    describe_past_arms,
    export_trials,
    has_memory,
    import_trials,
    open_memory,
)
from affordance.extensions.memory.summary import summarise
from affordance.extensions.memory.trial_evidence import PayloadQuadratic, pack, read_record
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

PRIOR = Prior()


@pytest.fixture
def ledger(tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as opened:
        yield opened


def _assert_same(one, other):
    """Asserts that a memory believes the same of the same colours as another memory, to 1e-9."""
    assert set(one.colours) == set(other.colours)
    order = [one.colours.index(colour) for colour in other.colours]
    np.testing.assert_allclose(
        one.belief.precision[np.ix_(order, order)], other.belief.precision, rtol=1e-9, atol=1e-20
    )
    np.testing.assert_allclose(one.belief.information_vector[order], other.belief.information_vector, rtol=1e-9)


def _count_things(ledger):
    return {thing.name: thing.experience.trials for thing in summarise(ledger, PRIOR).things}


def _learn(trials):
    return module.replay(trials, start_memory(), PRIOR)


def test_a_trial_counts_once(ledger):
    trials = hold_workshop(6)
    assert ledger.append(trials) == 6
    before = ledger.recall()
    assert ledger.append(trials[2:5]) == 0
    assert len(ledger) == 6
    assert trials[0].id in ledger
    assert hold("bar", (WOOD,), (600.0,), 99).id not in ledger
    _assert_same(ledger.recall(), before)


def test_of_records_of_one_recording_the_first_is_kept_in_any_order_of_merging(tmp_path):
    """The same recording, read with another size of the object, by another program, and later."""
    first, *others = hold_workshop(4)
    seen = first.parts[0]._replace(sizes=(0.06, 0.05, 0.05))
    records = [
        replace(first, source_hash="recording", **changes)
        for changes in ({}, {"parts": (seen,)}, {"robot": "third"}, {"object_name": "plank", "time": "2026-01-02"})
    ]
    assert len({record.id for record in records}) == 1
    assert len({record.digest for record in records}) == 4
    beliefs = []
    for number, order in enumerate(itertools.islice(itertools.permutations(range(4)), 0, 24, 5)):
        with open_memory(tmp_path / f"{number}.sqlite") as ledger:
            ledger.append([records[order[0]], *others])
            ledger.recall()
            if number % 2:
                ledger.append([records[i] for i in order[1:]])
            for i in order[1:]:
                assert ledger.append([records[i]]) == 0
            assert ledger.verify() == []
            digests = [each.digest for each in ledger.list_trials()]
            beliefs.append((ledger.recall().belief.precision.tolist(), digests))
    kept = min(records[:3], key=lambda record: record.digest)
    assert beliefs[0][1][0] == kept.digest
    assert all(each[1] == beliefs[0][1] for each in beliefs)
    np.testing.assert_allclose([each[0] for each in beliefs], [beliefs[0][0]] * 5, rtol=1e-9)


def test_recalled_belief_does_not_depend_on_the_order_of_things(ledger):
    trials = hold_workshop(12)
    for trial in trials:
        ledger.append([trial])
    by_thing = [*trials[0::3], *trials[1::3], *trials[2::3]]
    _assert_same(ledger.recall(), _learn(by_thing))
    assert _count_things(ledger) == {"bar": 4, "rod": 4, "hammer": 4}


def test_any_order_of_appending_and_merging_gives_one_belief(tmp_path):
    trials = hold_workshop(7)
    memories = []
    for number, order in enumerate(itertools.islice(itertools.permutations(range(7)), 0, 5040, 997)):
        halves = []
        for half in (order[:4], order[2:]):  # two trials are in both
            opened = open_memory(tmp_path / f"{number} {len(halves)}.sqlite")
            for index in half:
                opened.append([trials[index]])
            halves.append(opened)
        assert halves[0].append(halves[1].list_trials()) == 3
        memories.append(halves[0].recall())
        kinds = halves[0].recall(KINDS_MAP)
        assert halves[0].verify() == []
        for each in halves:
            each.close()
    for memory in memories[1:]:
        assert memory.colours == memories[0].colours
        assert np.array_equal(memory.belief.precision, memories[0].belief.precision)
        assert np.array_equal(memory.belief.information_vector, memories[0].belief.information_vector)
    replayed = module.replay(trials, start_memory(KINDS_MAP), PRIOR)
    assert np.array_equal(kinds.belief.precision, replayed.belief.precision)


@pytest.mark.parametrize(
    ("selection", "remains"),
    [
        (Selection(object_name="hammer"), lambda i: i % 3 != 2),
        (Selection(object_name="bar"), lambda i: i % 3 != 0),
        (Selection(robot="arm"), lambda i: i % 2 == 0),
        (Selection(since="2026-01-01T00:00:08"), lambda i: i < 8),
        (Selection(until="2026-01-01T00:00:01"), lambda i: i >= 1),
        (
            Selection(robot="other", since="2026-01-01T00:00:04", until="2026-01-01T00:00:09"),
            lambda i: i not in (4, 6, 8),
        ),
    ],
)
def test_forgetting_leaves_the_belief_of_never_having_known(ledger, selection, remains):
    trials = hold_workshop(12)
    ledger.append(trials)
    kept = [trial for i, trial in enumerate(trials) if remains(i)]
    assert ledger.forget(selection) == 12 - len(kept)
    _assert_same(ledger.recall(), _learn(kept))
    assert ledger.verify() == []
    assert ledger.forget(selection) == 0


def test_forgetting_one_trial_and_bad_selections(ledger):
    trials = hold_workshop(6)
    ledger.append(trials)
    assert ledger.forget(Selection(trial=trials[4].id[:8])) == 1
    assert len(ledger) == 5
    for selection, message in (
        (Selection(), "selection: is empty"),
        (Selection(trial="ab"), "trial: is 'ab', must be at least 4 digits"),
        (Selection(since="yesterday"), "since: is 'yesterday', must be a time such as"),
    ):
        with pytest.raises(BadArgumentError, match=message):
            ledger.forget(selection)
    assert len(ledger) == 5


def test_one_name_with_two_looks_is_two_things(ledger):
    ledger.append(
        [hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 0), hold("hammer", (WOOD, BRASS), (650.0, 8500.0), 1)]
    )
    ledger.append(
        [hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 2), hold("hammer", (WOOD, BRASS), (650.0, 8500.0), 3)]
    )
    assert _count_things(ledger) == {"hammer": 2, "hammer #2": 2}


@pytest.mark.parametrize("number", range(0, 120, 17))
def test_things_are_the_same_in_any_order_of_appending(ledger, number):
    """Looks of which each is like the next one, and not like all: the first that is met in time decides."""
    trials = [hold("bar", (WOOD,), (600.0,), i) for i in range(5)]
    trials = [
        replace(trial, parts=(trial.parts[0]._replace(sizes=(size, size, size)),))
        for trial, size in zip(trials, (0.0512, 0.05, 0.0524, 0.0512, 0.0536), strict=True)
    ]
    for index in list(itertools.permutations(range(5)))[number]:
        ledger.append([trials[index]])
    assert _count_things(ledger) == {"bar": 4, "bar #2": 1}


def test_things_have_all_names_of_theirs_and_of_each_its_own(ledger):
    """Objects that look alike are one thing, whatever their names; one name may be of several things."""
    looks = [("bar", WOOD), ("plank", WOOD), ("bar", STEEL), ("bar", BRASS), ("bar", STEEL), ("bar", WOOD)]
    ledger.append([hold(name, (colour,), (900.0,), i) for i, (name, colour) in enumerate(looks)])
    assert _count_things(ledger) == {"bar, plank": 3, "bar": 2, "bar #2": 1}


def test_materials_and_things_are_bounded(ledger, monkeypatch):
    colours = [(0.1 * i, 0.5, 0.5) for i in range(6)]
    ledger.append([hold(f"bar {i}", (colour,), (900.0,), i) for i, colour in enumerate(colours)])
    monkeypatch.setattr(module, "MOST_MATERIALS", 5)
    assert "colours: are of 6 materials, must be of at most 5" in refuse(ledger.recall)
    monkeypatch.setattr(module, "MOST_THINGS", 3)
    assert "objects: are 4 different ones, must be at most 3" in refuse(ledger.recall)


_WRITER = """
import sys
sys.path[:0] = sys.argv[4:]
from helpers.trials import WOOD, hold
from affordance.extensions.memory.ledger import has_memory, open_memory
ledger = open_memory(sys.argv[1])
first, count = int(sys.argv[2]), int(sys.argv[3])
for seed in range(first, first + count):
    trial = hold("bar", (WOOD,), (600.0,), seed)
    ledger.append([trial])
    print(trial.id, flush=True)
"""


def _start_writer(path, first, count):
    words = [sys.executable, "-c", _WRITER, str(path), str(first), str(count), *filter(None, sys.path)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_two_writers_of_which_one_is_killed_lose_nothing_and_count_nothing_twice(tmp_path):
    path = tmp_path / "memory.sqlite"
    with _start_writer(path, 0, 100_000) as killed, _start_writer(path, 200_000, 25) as finishes:
        acknowledged = [killed.stdout.readline().strip() for _ in range(20)]
        os.kill(killed.pid, signal.SIGKILL)
        acknowledged += killed.stdout.read().split()
        assert all(acknowledged), killed.stderr.read()
        out, error = finishes.communicate(timeout=120)
    assert finishes.returncode == 0, error
    acknowledged += out.split()
    with open_memory(path) as ledger:
        ids = {trial.id for trial in ledger.list_trials()}
        assert set(acknowledged) <= ids
        assert len(acknowledged) <= len(ids) <= len(acknowledged) + 1  # one may have been written unsaid
        assert ledger.verify() == []


def test_full_disk_is_a_line_and_changes_nothing(ledger, monkeypatch):
    ledger.append(hold_workshop(3))
    before = ledger.recall()
    monkeypatch.setattr(module, "LARGEST_FILE", 100_000)
    with open_memory(ledger.place) as full:
        many = [hold(f"bar {i}", (WOOD,), (600.0,), 100 + i) for i in range(50)]
        message = r"cannot be written: .*full; nothing was changed"
        with pytest.raises(BadValueError, match=message):
            full.append(many)
        assert full.append(many[:3]) == 3
        assert full.forget(Selection(object_name="bar 1")) == 1
    assert len(ledger) == 5
    ledger.forget(Selection(since="2026-01-01T00:01"))
    _assert_same(ledger.recall(), before)


def _make(path, content):
    path.write_bytes(content)


def _make_other(path, content):
    with closing(sqlite3.connect(path, autocommit=True)) as connection:
        connection.execute("CREATE TABLE songs (name TEXT)")


def _truncate(path, content):
    with open_memory(path) as ledger:
        ledger.append(hold_workshop(60))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


def _spoil_text(path, content):
    with open_memory(path):
        pass
    path.write_bytes(path.read_bytes().replace(b"CREATE TABLE joins", content))


@pytest.mark.parametrize(
    ("make", "content", "message"),
    [
        (_spoil_text, b"CREATE TABL\xfd joins", "cannot be read: .*nothing was changed"),
        (_make, b"not a database at all", "is not an SQLite file, must be a memory"),
        (_make, b'{"colours": []}', "a command has written; affordance memory import reads an exported one"),
        (_make, b"SQLite format 3\x00 but no more", "cannot be (read|written).*: file is not a database"),
        (_make_other, b"", "is a database of another program or version"),
        (_truncate, b"", "malformed|is damaged"),
    ],
)
def test_files_that_are_no_memory_are_refused_in_a_line_and_left_as_they_are(tmp_path, make, content, message):
    path = tmp_path / "memory.sqlite"
    make(path, content)
    before = path.read_bytes()

    def use():
        with open_memory(path) as ledger:
            ledger.append(hold_workshop(70))
            ledger.list_trials()

    with pytest.raises(BadValueError, match=message) as caught:
        use()
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("", "place: is '', must be the path of an SQLite file"),
        (3, "place: is 3, must be the path"),
        ("nowhere/memory.sqlite", "cannot be created: there is no folder 'nowhere'"),
    ],
)
@pytest.mark.parametrize("use", [open_memory, has_memory])
def test_places_that_cannot_be_are_refused(place, message, use):
    with pytest.raises(AffordanceError, match=message):
        use(place)


def test_a_memory_that_must_exist_is_not_made(tmp_path):
    assert "does not exist, must be a memory" in refuse(open_memory, tmp_path / "memory.sqlite", create=False)
    assert not list(tmp_path.iterdir())
    (tmp_path / "memory.sqlite").touch()
    assert "is empty, must be a memory" in refuse(open_memory, tmp_path / "memory.sqlite", create=False)
    assert (tmp_path / "memory.sqlite").stat().st_size == 0


def _change(place, change):
    """Changes the first record from outside of the program."""
    with closing(sqlite3.connect(place, autocommit=True)) as connection:
        first = "rowid = (SELECT min(rowid) FROM trials)"
        (text,) = connection.execute(f"SELECT content FROM trials WHERE {first}").fetchone()
        change(content := json.loads(text))
        connection.execute(f"UPDATE trials SET content = ? WHERE {first}", (json.dumps(content),))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda content: content["features"].__setitem__(0, content["features"][0] + 0.5), "id: is '"),
        (lambda content: content["parts"][0]["sizes"].__setitem__(0, 0.0501), "digest: is '"),
        (lambda content: content.update(p_value=0.5), "digest: is '"),
        (lambda content: content.update(robot="third"), "digest: is '"),
        (lambda content: content.pop("features"), "features: is missing"),
    ],
)
def test_records_that_were_changed_from_outside_are_found_by_all_who_read_them(ledger, change, problem):
    ledger.append(hold_workshop(6))
    _change(ledger.place, change)
    (found,) = ledger.verify()
    assert problem in found
    assert found.startswith(f"{ledger.place}: trial ")
    for read in (ledger.recall, ledger.list_trials, ledger.review, partial(ledger.recall, KINDS_MAP)):
        with pytest.raises(BadValueError) as caught:
            read()
        assert str(caught.value) == found
    assert ledger.append(hold_workshop(9)) >= 3
    assert ledger.forget(Selection(since="2026-01-01")) >= 8


def test_what_is_no_selection_or_no_list_of_trials_is_refused(ledger):
    assert "must be of type Selection" in refuse(ledger.forget, None, error=BadArgumentError)
    assert "must be of type Sequence" in refuse(ledger.append, None, error=BadArgumentError)


# What SQLite would calculate for each row, with any amount of memory.
SLOW = "length(hex(zeroblob(1000 + length(id))))"


@pytest.mark.parametrize(
    "script",
    [
        f"CREATE INDEX evil ON trials ({SLOW})",
        f"DROP INDEX by_time; CREATE INDEX by_time ON trials ({SLOW})",
        "DROP INDEX by_time",
        f"CREATE TRIGGER evil AFTER DELETE ON trials BEGIN SELECT {SLOW} FROM trials; END",
        f"CREATE VIEW evil AS SELECT {SLOW} FROM trials",
        "CREATE VIRTUAL TABLE evil USING fts5(x)",
        f"ALTER TABLE trials ADD COLUMN evil AS ({SLOW})",
        "CREATE TABLE notes (x INT)",
        f"DROP TABLE joins; CREATE VIEW joins AS SELECT {SLOW} FROM trials",
    ],
)
def test_tables_that_the_program_does_not_write_are_refused_and_not_calculated(ledger, script):
    with closing(sqlite3.connect(ledger.place, autocommit=True)) as connection:
        connection.executescript(script)
    before = ledger.place.read_bytes()
    assert "is a database of another program or version (tables: " in refuse(open_memory, ledger.place)
    assert ledger.place.read_bytes() == before


def test_a_file_that_is_too_large_is_refused(ledger, monkeypatch):
    ledger.append(hold_workshop(9))
    monkeypatch.setattr(module, "LARGEST_FILE", 10_000)
    with pytest.raises(BadValueError, match=r"memory.sqlite: has 0.0\d+ MB, must have at most 0.01 MB"):
        open_memory(ledger.place)


def test_an_exported_memory_is_read_as_it_was(ledger, tmp_path):
    ledger.append(hold_workshop(5))
    assert export_trials(ledger, tmp_path / "trials.jsonl") == 5
    found = import_trials(tmp_path / "trials.jsonl")
    assert [trial.to_dict() for trial in found] == [trial.to_dict() for trial in ledger.list_trials()]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("[" * 100_000, "line 2: is not JSON: "),
        ("9" * 10_000, "line 2: is not JSON: "),
        ("NaN", "line 2: is nan, must be a mapping of keys to values"),
        ("{}", "line 2.id: is missing"),
    ],
)
def test_lines_that_are_no_records_are_refused(tmp_path, line, message):
    path = tmp_path / "trials.jsonl"
    path.write_text(f"\n{line}\n")
    assert message in refuse(import_trials, path)


def write_arms(folder: Path, *arms: str, robot: str = "mine") -> str:
    """Writes a memory of trials of a robot, and one of another robot, by the fingerprints of their arms."""
    path = folder / "memory.sqlite"
    trials = [hold("bar", (WOOD,), (600.0,), i, robot=robot) for i in range(len(arms) + 1)]
    known = [replace(trial, fingerprint=arm) for trial, arm in zip(trials, (*arms, "old"), strict=True)]
    with open_memory(path) as ledger:
        ledger.append([*known[:-1], replace(known[-1], robot="yours")])
    return str(path)


@pytest.mark.parametrize(
    ("arms", "count"),
    [
        ((), 0),
        (("",), 0),
        (("now",), 0),
        (("old",), 1),
        (("old", "old"), 2),
        (("old", "", "now", "older", "", "now"), 2),
    ],
)
def test_trials_of_another_known_arm_are_counted(tmp_path: Path, arms: Sequence[str], count: int) -> None:
    assert count_past_arms(write_arms(tmp_path, *arms), "mine", lambda: "now") == count


@pytest.mark.parametrize("arms", [(), ("", "")])
def test_arm_is_recognised_only_where_it_can_be_another(tmp_path: Path, arms: Sequence[str]) -> None:
    assert count_past_arms(write_arms(tmp_path, *arms), "mine", lambda: pytest.fail("was recognised")) == 0


def test_without_a_memory_nothing_is_counted_and_none_is_made(tmp_path: Path) -> None:
    for place in ("", str(tmp_path / "nowhere.sqlite")):
        assert count_past_arms(place, "mine", lambda: "now") == 0
    assert not list(tmp_path.iterdir())


def test_it_is_said_of_how_many_trials_the_arm_was_another() -> None:
    assert describe_past_arms("mine", 3) == "mine had another arm in 3 of its trials, which still count for materials"
    assert describe_past_arms("mine", 0) == ""


_BLUE, _GREEN = (0.1, 0.2, 0.8), (0.1, 0.7, 0.2)


@pytest.fixture
def two_cameras(tmp_path):
    """Two ledgers of the same holds: of one camera, and every other hold of a camera that sees wood as blue."""
    with open_memory(tmp_path / "one.sqlite") as one, open_memory(tmp_path / "two.sqlite") as two:
        for i, trial in enumerate(hold_workshop(9)):
            parts = tuple(part._replace(colour=_BLUE if part.colour == WOOD else part.colour) for part in trial.parts)
            one.append([trial])
            two.append([replace(trial, parts=parts if i % 2 else trial.parts)])
        yield one, two


def test_joined_colours_give_the_beliefs_of_one_camera(two_cameras):
    """Also objects of one name are one thing again, whichever colour is meant; records stay as they are."""
    one, two = two_cameras
    assert _count_things(two).keys() - _count_things(one).keys() == {"bar #2", "hammer #2"}
    records = [trial.digest for trial in two.list_trials()]
    for meant, other in ((WOOD, _BLUE), (_BLUE, WOOD)):
        two.join([(meant, other)])
        for learner in LEARNERS.values():
            wanted = one.recall(learner)
            found = two.recall(learner)
            colours = [meant if colour == WOOD else colour for colour in wanted.colours]
            np.testing.assert_allclose(found.colours, colours, atol=0.5 / 255)
            assert np.array_equal(found.belief.precision, wanted.belief.precision)
            assert np.array_equal(found.belief.information_vector, wanted.belief.information_vector)
        assert _count_things(two) == _count_things(one)
    assert [trial.digest for trial in two.list_trials()] == records
    two.join([])
    assert "bar #2" in _count_things(two)


def test_a_measured_colour_is_joined_if_it_is_certain(ledger):
    seen = hold("bar", (WOOD,), (600.0,), 0)
    near = seen.parts[0]._replace(colour=(0.71, 0.5, 0.29), colour_sd=2.0)
    ledger.append([replace(seen, parts=(near,)), hold("plank", (STEEL,), (600.0,), 1)])
    ledger.join([(BRASS, WOOD)])
    np.testing.assert_allclose(ledger.recall().colours, (BRASS, STEEL), atol=0.5 / 255)


def test_chains_of_pairs_are_joined_and_mistakes_refused(ledger):
    ledger.append([hold(f"bar {i}", (colour,), (600.0,), i) for i, colour in enumerate((WOOD, _BLUE, _GREEN))])
    ledger.join([(_BLUE, WOOD), (_GREEN, _BLUE)])
    assert [meant for _, meant in ledger.list_joins()] == ["#1ab233"] * 2
    ledger.join([(_BLUE, WOOD), (WOOD, _GREEN)])
    assert len(ledger.recall().colours) == 1
    assert "#1a33cc=#1a33cc, which count as one colour" in refuse(ledger.join, [(_BLUE, _BLUE)])
    assert "which count as one colour" in refuse(ledger.join, [(_BLUE, WOOD), (WOOD, _BLUE)])
    message = "has no part of the second colour of #1a33cc=#808080; the nearest is"
    assert message in refuse(ledger.join, [(_BLUE, STEEL)])
    assert len(ledger.list_joins()) == 2


_VALUES = [
    *(None, True, "", "x", "\x1b[2J\x07", "a\r\nb", "\u202eb", "\u200b", "\ue000", "\ud800", "n" * 501, "1e400"),
    *(-1, 0, 1, 0.5, 1e-300, -1e-30, 1e6, 1e15, 1e17, 1e21, 1e150, -1e150, 1e308, 10**400, np.nan, np.inf, -np.inf),
    *([], {}, [[]], [1.0], [0.0] * 10, [[0.0] * 10] * 10, {"a": 1}, [None], [[[]]], [1e300] * 110),
]


def _list_trials():
    """Trials of all models, of one part and of two, with and without errors of the geometry."""
    two = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, num_errors=3)
    payload = pack(Quadratic(np.diag([1e4] * 10), np.full(10, 3.0)))
    return [
        two,
        hold("bar", (WOOD,), (600.0,), 6, model=WeberNoise(), num_errors=1),
        hold("rod", (STEEL,), (7800.0,), 7, model=WhiteNoise(0.3)),
        replace(two, model=PayloadQuadratic(), features=payload, source_hash="run"),
    ]


def _list_places(content, place=()):
    """Lists the places of all values in JSON."""
    if not isinstance(content, dict | list):
        return
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield (*place, key)
        yield from _list_places(value, (*place, key))


def _scale(content, factor):
    if isinstance(content, list):
        return [_scale(each, factor) for each in content]
    return content * factor if isinstance(content, float) else content


def _alter(content, rng):
    """Changes a value, the numbers of a list, its size, or the keys; half of the time numbers alone."""
    first = list(content)[rng.integers(len(content))]
    places = [(first,), *((first, *place) for place in _list_places(content[first]))]
    *way, key = places[rng.integers(len(places))]
    within = content
    for each in way:
        within = within[each]
    match rng.integers(12):
        case 0:
            del within[key]
        case 1 if isinstance(within, list):
            within.insert(key, copy.deepcopy(within[key]))
        case 2 if isinstance(within[key], list):
            within[key] = [within[key]]
        case 3 if isinstance(within, dict):
            within["more"] = within[key]
        case 4 | 5:
            within[key] = copy.deepcopy(_VALUES[rng.integers(len(_VALUES))])
        case _:
            within[key] = _scale(within[key], float(rng.choice([-1.0, 0.0, 10.0 ** rng.integers(-20, 20)])))


def _sign(content):
    """Gives a record the id and the digest of its content, as anybody can."""
    for key in ("id", "digest"):
        try:
            read_record(Path("x"), "", json.dumps(content))
        except AffordanceError as error:
            if found := re.search(rf"{key}: is .*, must be '([0-9a-f]{{24}})'", str(error)):
                content[key] = found[1]


def _store(path, content, rows):
    """Stores a record beside others, as a stranger's program would."""
    with open_memory(path) as ledger:
        ledger.append(rows)
    with (
        closing(sqlite3.connect(path, autocommit=True)) as connection,
        suppress(UnicodeEncodeError, sqlite3.Error),
    ):
        connection.execute("INSERT INTO trials (content) VALUES (?)", [json.dumps(content)])


def try_all(tmp_path, content):
    """Does with a memory that holds a record all that there is to do; returns what was answered."""
    path, other, file = (tmp_path / name for name in ("a.sqlite", "b.sqlite", "c.jsonl"))
    for each in (path, other, file):
        each.unlink(missing_ok=True)
    _store(path, content, hold_workshop(2))
    said = []
    with open_memory(path) as ledger, open_memory(other) as receiver:
        for use in (
            ledger.recall,
            partial(ledger.recall, KINDS_MAP),
            partial(ledger.join, [(WOOD, STEEL)]),
            ledger.recall,
            ledger.verify,
            partial(summarise, ledger, Prior()),
            lambda: receiver.append(ledger.list_trials()),
            receiver.recall,
            partial(export_trials, ledger, file),
            partial(import_trials, file),
            partial(ledger.append, hold_workshop(4)),
            partial(ledger.forget, Selection(object_name="bar")),
        ):
            try:
                use()
            except AffordanceError as error:
                said.append(str(error))
    return said


@pytest.mark.parametrize("seed", range(4))
def test_any_record_is_worked_with_or_refused_in_one_line(tmp_path, seed):
    rng = np.random.default_rng([20261127, seed])
    trials = _list_trials()
    for number in range(10):
        content = trials[number % len(trials)].to_dict()
        for _ in range(rng.integers(1, 4)):
            _alter(content, rng)
        if rng.random() < 0.8:
            _sign(content)
        for said in try_all(tmp_path, content):
            assert said.isprintable()
            assert len(said) < 2100


@pytest.mark.parametrize("seed", range(2))
def test_whatever_can_be_appended_is_read_as_it_was_written(tmp_path, seed):
    """Also extreme numbers, and numbers and sequences of other types."""
    rng = np.random.default_rng([20261128, seed])
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        taken = {}
        for trial in _list_trials() * 20:
            name = list(_CHANGES)[rng.integers(len(_CHANGES))]
            with suppress(AffordanceError):
                changed = replace(
                    trial, **{name: _CHANGES[name][rng.integers(len(_CHANGES[name]))](getattr(trial, name))}
                )
                changed = replace(changed, source_hash=f"{seed} {len(taken)}")
                ledger.append([changed])
                taken[changed.id] = changed.to_dict()
        assert len(taken) > 20
        assert {trial.id: trial.to_dict() for trial in ledger.list_trials()} == taken
        assert ledger.verify() == []


_CHANGES = {
    "object_name": [
        str.upper,
        lambda name: "n" * 200,
        lambda name: "n" * 201,
        lambda name: "\u202e",
        lambda name: "é",
    ],
    "parts": [
        lambda parts: [part._replace(position=(10, 0, 0)) for part in parts],
        lambda parts: [part._replace(position=np.array([10.1, 0.0, 0.0])) for part in parts],
        lambda parts: [part._replace(sizes=[np.float32(0.1)] * 2, colour=[1, 0, 0]) for part in parts],
        lambda parts: parts[:1],
        lambda parts: (),
    ],
    "features": [
        lambda features: features * 1e3,
        lambda features: features * 1e150,
        lambda features: features[:-1],
        lambda features: features.astype(int),
        lambda features: np.nextafter(features, np.inf),
        lambda features: features.tolist(),
    ],
    "geometry": [
        lambda of: replace(of, Phi=np.asfortranarray(of.Phi)),
        lambda of: replace(of, Phi_errors=np.zeros((0, *of.Phi.shape))),
        lambda of: replace(of, Phi=1e9 * of.Phi),
        lambda of: replace(of, Phi_errors=np.ones((2000, *of.Phi.shape)) / 3.0),
    ],
    "num_samples": [lambda n: np.int64(5), lambda n: 2.0, lambda n: 1.5, lambda n: True],
    "time": [lambda text: "2026-03-01T12:00+02:00", lambda text: "0001-01-01", lambda text: "9999-12-31T23:59:59Z"],
    "log_evidence": [lambda value: 0, lambda value: -np.float64(12.0), lambda value: 1e300],
    "robot": [lambda name: "", lambda name: "a\nb", lambda name: "n" * 500],
    "source": [lambda name: "", lambda name: "\udcff", lambda name: 3],
}
