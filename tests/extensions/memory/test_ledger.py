"""The ledger: a trial that is appended is kept once, and beliefs do not depend on the order of trials."""

import itertools
import json
import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.summed_trials import sum_trials
from helpers.trials import BRASS, STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.belief.learners import DENSITY, KINDS_MAP
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.exceptions import AffordanceError, BadArgumentError, BadValueError
from affordance.extensions.memory import ledger as module
from affordance.extensions.memory import tables
from affordance.extensions.memory.evidence_sums import EvidenceSums
from affordance.extensions.memory.ledger import has_memory, open_memory
from affordance.extensions.memory.stored_trials import Selection

PRIOR = Prior()


@pytest.fixture
def ledger(tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as opened:
        yield opened


def _assert_same(one, other):
    """Asserts that a memory believes the same of the same colours as another memory, or sums, to 1e-9."""
    if isinstance(other, EvidenceSums):
        other = MaterialMemory.from_belief(other.colours, other.build_belief())
    assert set(one.colours) == set(other.colours)
    order = [one.colours.index(colour) for colour in other.colours]
    np.testing.assert_allclose(
        one.belief.precision[np.ix_(order, order)], other.belief.precision, rtol=1e-9, atol=1e-20
    )
    np.testing.assert_allclose(one.belief.information_vector[order], other.belief.information_vector, rtol=1e-9)


def _count_things(ledger):
    return {name: thing.trials for name, thing in ledger.sum().things.items()}


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


def test_recalled_belief_is_the_sum_over_things(ledger):
    trials = hold_workshop(12)
    for trial in trials:
        ledger.append([trial])
    by_thing = [*trials[0::3], *trials[1::3], *trials[2::3]]
    _assert_same(ledger.recall(), sum_trials(by_thing, PRIOR))
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
        assert halves[0].merge(halves[1]) == 3
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
    assert np.array_equal(ledger.recall().belief.precision, sum_trials(kept, PRIOR).build_belief().precision)
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
    monkeypatch.setattr(tables, "LARGEST_FILE", 100_000)
    with open_memory(ledger.place) as full:
        many = [hold(f"bar {i}", (WOOD,), (600.0,), 100 + i) for i in range(50)]
        message = r"cannot be written: .*full; a memory has at most 0.1 MB; nothing was changed"
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


def _make_schema(path, content):
    open_memory(path).close()
    with closing(sqlite3.connect(path, autocommit=True)) as connection:
        connection.execute("UPDATE about SET value = '1' WHERE name = 'schema'")


def _truncate(path, content):
    with open_memory(path) as ledger:
        ledger.append(hold_workshop(60))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


@pytest.mark.parametrize(
    ("make", "content", "message"),
    [
        (_make, b"not a database at all", "is not an SQLite file, must be a memory"),
        (_make, b'{"colours": []}', "is JSON, must be an SQLite file; affordance memory import"),
        (_make, b"SQLite format 3\x00 but no more", "cannot be (read|written).*: file is not a database"),
        (_make_other, b"", r"is a database of another program \(tables: songs\)"),
        (_make_schema, b"", "schema: is '1', must be '3': another version of the program"),
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
        ("a\0b.sqlite", r"place: is 'a.x00b.sqlite', must be the path"),
        ("sqlite:///memory.sqlite", "^sqlite://...: is a URL, must be the path of an SQLite file; to share memories"),
        (Path("sqlite:///memory.sqlite"), "^sqlite://...: is a URL"),
        ("postgresql://me:secret@host:abc/memory", "^postgresql://...: is a URL, must be the path of an SQLite file"),
        ("mysql+driver://me:sec ret@host/memory?password=secret", r"^mysql\+driver://...: is a URL"),
    ],
)
@pytest.mark.parametrize("use", [open_memory, has_memory])
def test_places_that_cannot_be_are_refused_and_no_password_is_shown(place, message, use):
    with pytest.raises(AffordanceError, match=message) as caught:
        use(place)
    assert "ret" not in str(caught.value).replace("secret", "")


def test_a_memory_that_must_exist_is_not_made(tmp_path):
    assert "does not exist, must be a memory" in refuse(open_memory, tmp_path / "memory.sqlite", create=False)
    assert not list(tmp_path.iterdir())
    (tmp_path / "memory.sqlite").touch()
    assert "is empty, must be a memory" in refuse(open_memory, tmp_path / "memory.sqlite", create=False)
    assert (tmp_path / "memory.sqlite").stat().st_size == 0


def _change(place, change):
    """Changes the first record from outside of the program, or as a statement in SQL says."""
    with closing(sqlite3.connect(place, autocommit=True)) as connection:
        first = "rowid = (SELECT min(rowid) FROM trials)"
        if isinstance(change, str):
            connection.execute(f"{change} WHERE {first}")
        else:
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
        (lambda content: content.pop("digest"), "digest: is missing"),
        ("UPDATE trials SET content = 'nothing'", "is not JSON"),
        ("UPDATE trials SET time = '2027'", "column time is '2027', must be '2026-01-01T00:00:00"),
        ("UPDATE trials SET id = '0'", "column id is '0', must be '"),
        ("UPDATE trials SET digest = '0'", "column digest is '0', must be '"),
        ("UPDATE trials SET object = 'rod'", "column object is 'rod', must be 'bar', as in the record"),
        ("UPDATE trials SET fingerprint = ''", "column fingerprint is '', must be 'other 1', as in the record"),
        ("UPDATE trials SET robot = 'third'", "column robot is 'third', must be 'other', as in the record"),
    ],
)
def test_records_and_columns_that_were_changed_from_outside_are_found_by_all_who_read_them(ledger, change, problem):
    ledger.append(hold_workshop(6))
    _change(ledger.place, change)
    (found,) = ledger.verify()
    assert problem in found
    assert found.startswith(f"{ledger.place}: trial ")
    for read in (ledger.recall, ledger.list_trials, ledger.sum, partial(ledger.recall, KINDS_MAP)):
        with pytest.raises(BadValueError) as caught:
            read()
        assert str(caught.value) == found
    assert ledger.append(hold_workshop(9)) >= 3
    assert ledger.forget(Selection(since="2026-01-01")) >= 8


def test_evidence_that_fits_no_densities_names_its_trial(ledger):
    """All joints feel one torque, of a shape that may be anything: errors that are equal to rounding."""
    trial = hold("bar", (WOOD,), (600.0,), 0)
    same = np.concatenate([np.full(14, 5.0), np.ones(70)])
    geometry = replace(trial.geometry, Phi_errors=np.full((1, 10, 1), 1e6))
    ledger.append([hold("rod", (STEEL,), (7800.0,), 1), replace(trial, features=same, geometry=geometry)])
    (bad, _) = ledger.list_trials()
    for learner in (DENSITY, KINDS_MAP):
        with pytest.raises(BadValueError) as caught:
            ledger.recall(learner)
        assert str(caught.value) == f"{ledger.place}: trial {bad.id}: cannot be learned from: Singular matrix"
    assert ledger.verify() == []
    ledger.forget(Selection(trial=bad.id))
    assert len(ledger.recall().colours) == 1


def test_what_is_no_selection_or_no_list_of_trials_is_refused(ledger):
    assert "must be of type Selection" in refuse(ledger.forget, None, error=BadArgumentError)
    assert "must be of type Sequence" in refuse(ledger.append, None, error=BadArgumentError)
