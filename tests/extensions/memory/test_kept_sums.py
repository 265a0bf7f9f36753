"""Kept sums of large memories: they save time, and decide nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.summed_trials import sum_trials
from helpers.trials import PLAIN, STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.extensions.memory import evidence_sums, kept_sums
from affordance.extensions.memory import ledger as module
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.stored_trials import Selection
from affordance.proprioception.torque_noise import WeberNoise

PRIOR = Prior()


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for each in (kept_sums, module):
        monkeypatch.setattr(each, "WORTH_KEEPING", 6)
    return tmp_path / "cache"


@pytest.fixture
def place(tmp_path):
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        ledger.append(hold_workshop(9))
    return tmp_path / "memory.sqlite"


@pytest.fixture
def count(monkeypatch):
    """Counts the trials whose evidence is computed."""
    counted = []
    measure = evidence_sums.measure_body
    monkeypatch.setattr(evidence_sums, "measure_body", lambda *words: counted.append(words) or measure(*words))
    return counted


def _recall(place, count, prior=PRIOR):
    """Returns what is believed, and how many trials were summed for it."""
    count.clear()
    with open_memory(place) as ledger:
        believed = ledger.recall(prior=prior)
    return (believed.colours, believed.belief.precision.tolist(), believed.belief.information_vector.tolist()), len(
        count
    )


def test_a_memory_is_summed_once_and_then_what_was_added(cache, place, count):
    first, number = _recall(place, count)
    assert number == 9
    assert _recall(place, count) == (first, 0)
    with open_memory(place) as ledger:
        ledger.append(hold_workshop(12))
        ledger.append([hold("plank", (WOOD, STEEL), (600.0, 7800.0), 99, model=WeberNoise(), num_errors=2)])
        wanted = sum_trials(ledger.list_trials(), PRIOR).build_belief()
    found, number = _recall(place, count)
    assert number == 4
    assert found[1:] == (wanted.precision.tolist(), wanted.information_vector.tolist())
    assert _recall(place, count) == (found, 4)  # too few to be worth keeping
    with open_memory(place) as ledger:
        ledger.append([hold("plank", (WOOD, STEEL), (600.0, 7800.0), 100 + i, model=PLAIN) for i in range(6)])
    assert [_recall(place, count)[1] for _ in range(2)] == [10, 0]
    assert len(list(cache.rglob("*.json"))) == 1


def test_what_is_kept_is_all_that_is_summed(cache, place):
    with open_memory(place) as ledger:
        computed = ledger.sum()
        assert ledger.sum(Prior(sd=10.0)).colours == computed.colours
        kept = kept_sums.load_sums(place, PRIOR)
        assert kept.number == 9
        assert kept.sums.names == computed.names
        for name, thing in computed.things.items():
            again = kept.sums.things[name]
            assert (again.parts, again.since, again.trials, again.robots) == (
                thing.parts,
                thing.since,
                thing.trials,
                thing.robots,
            )
            for one, other in zip(
                (*thing.compute_likelihood(PRIOR)[:2], thing.evidence.geometry.Phi_errors),
                (*again.compute_likelihood(PRIOR)[:2], again.evidence.geometry.Phi_errors),
                strict=True,
            ):
                assert np.array_equal(one, other)
                assert one.shape == other.shape


@pytest.mark.parametrize(
    "change",
    [
        lambda ledger: ledger.forget(Selection(object_name="bar")),
        lambda ledger: ledger.append([replace(hold_workshop(1)[0], source_hash="earlier", time="2025-01-01")]),
        lambda ledger: ledger._connection.execute("UPDATE trials SET robot = 'none' WHERE object = 'rod'"),
    ],
)
def test_sums_of_other_rows_are_not_used(cache, place, count, change):
    _recall(place, count)
    with open_memory(place) as ledger:
        change(ledger)
        (expected,) = {len(ledger)}
        if ledger.verify():
            with pytest.raises(module.BadValueError, match="column robot is 'none'"):
                ledger.recall()
            return
        wanted = sum_trials(ledger.list_trials(), PRIOR).build_belief()
    found, number = _recall(place, count)
    assert number == expected
    assert found[1] == wanted.precision.tolist()


def test_sums_are_of_a_prior_and_a_program(cache, place, count, monkeypatch):
    found, _ = _recall(place, count)
    other, number = _recall(place, count, Prior(sd=100.0))
    assert number == 9
    assert other != found
    assert _recall(place, count) == (found, 0)
    monkeypatch.setattr("affordance.runs.repeats.compute_key", lambda *words: "another program")
    assert _recall(place, count) == (found, 9)


def _damage(text):
    content = json.loads(text.split("\n")[1])
    content["things"]["bar"]["arrays"][3][0] *= 2.0
    return text.split("\n")[0] + "\n" + json.dumps(content)


@pytest.mark.parametrize(
    "change",
    [
        _damage,
        lambda text: text[: len(text) // 2],
        lambda text: "",
        lambda text: "[1, 2]\n{}",
        lambda text: "null\n" + text,
    ],
)
def test_sums_that_are_damaged_are_computed_anew(cache, place, count, change):
    found, _ = _recall(place, count)
    (file,) = cache.rglob("*.json")
    file.write_text(change(file.read_text()))
    assert _recall(place, count) == (found, 9)
    assert _recall(place, count) == (found, 0)


def test_a_cache_that_cannot_be_written_or_found_is_no_error(cache, place, count, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    found, _ = _recall(place, count)
    assert _recall(place, count) == (found, 9)
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path / "file"))
    assert _recall(place, count) == (found, 9)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "memory.sqlite"]


def test_small_memories_leave_no_trace(cache, place, monkeypatch):
    for each in (kept_sums, module):
        monkeypatch.setattr(each, "WORTH_KEEPING", 1000)
    with open_memory(place) as ledger:
        ledger.recall()
    assert not cache.exists()
