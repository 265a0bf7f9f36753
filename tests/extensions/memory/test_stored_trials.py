"""Records of strangers: whatever a record holds, a command works or answers in one line."""

import copy
import json
import re
import sqlite3
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.trials import STEEL, WOOD, hold, hold_workshop

from affordance.belief.density_belief import Prior
from affordance.belief.learners import KINDS_MAP
from affordance.belief.likelihood import Quadratic
from affordance.exceptions import AffordanceError, BadArgumentError
from affordance.extensions.memory.exchange import export_trials, read_trials
from affordance.extensions.memory.felt_models import PayloadQuadratic, pack
from affordance.extensions.memory.ledger import open_memory
from affordance.extensions.memory.stored_trials import Selection, parse_trial
from affordance.extensions.memory.summary import recall_felt, summarise
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

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


def _change(content, rng):
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
            parse_trial(Path("x"), "", content)
        except AffordanceError as error:
            if found := re.search(rf"{key}: is .*, must be '([0-9a-f]{{24}})'", str(error)):
                content[key] = found[1]


def _store(path, content, rows):
    """Stores a record beside others, as a stranger's program would."""
    with open_memory(path) as ledger:
        ledger.append(rows)
    keys = ("id", "time", "robot", "fingerprint", "object", "digest")
    with closing(sqlite3.connect(path, autocommit=True)) as connection, suppress(UnicodeEncodeError):
        row = [str(content.get(key)) for key in keys]
        connection.execute("INSERT INTO trials VALUES (?, ?, ?, ?, ?, ?, ?)", [*row, json.dumps(content)])


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
            partial(ledger.recall, same_colours=[(WOOD, STEEL)]),
            ledger.verify,
            partial(summarise, ledger, Prior()),
            partial(recall_felt, ledger, Prior()),
            partial(receiver.merge, ledger),
            receiver.recall,
            partial(export_trials, ledger, file),
            partial(read_trials, file),
            partial(ledger.append, hold_workshop(4)),
            partial(ledger.forget, Selection(object_name="bar")),
        ):
            try:
                use()
            except AffordanceError as error:
                said.append(str(error))
    return said


@pytest.mark.parametrize("seed", range(10))
def test_any_record_is_worked_with_or_refused_in_one_line(tmp_path, seed):
    rng = np.random.default_rng([20261127, seed])
    trials = _list_trials()
    for number in range(10):
        content = trials[number % len(trials)].to_dict()
        for _ in range(rng.integers(1, 4)):
            _change(content, rng)
        if rng.random() < 0.8:
            _sign(content)
        for said in try_all(tmp_path, content):
            assert said.isprintable()
            assert len(said) < 2100


@pytest.mark.parametrize("seed", range(5))
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


def test_a_record_that_is_too_large_is_not_written(tmp_path):
    trial, *_ = hold_workshop(1)
    large = replace(trial, geometry=replace(trial.geometry, Phi_errors=np.full((6000, 10, 1), 1.0 / 3.0)))
    with open_memory(tmp_path / "memory.sqlite") as ledger:
        message = f"trial {large.id}: has a record of more than 1 MB, must be smaller"
        assert refuse(ledger.append, [large], error=BadArgumentError) == message
        assert ledger.append([trial]) == 1


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


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("features.3", np.nan, "memory.jsonl: line 3.features[3]: is nan, must be finite"),
        ("features", [1.0], "features: has the shape (1,), must have (84,)"),
        ("features", "1", "features: is '1', must be"),
        ("Phi", [[1.0, 1.0]], "geometry.Phi: has the shape (1, 2), must have (10, 2)"),
        ("Phi.0", [1.0], "must be numbers of shape (10, 2)"),
        ("Phi.0.1", -0.001, "geometry.Phi[0][1]: is -0.001, must be from 1e-15 to 10000000 m^3"),
        ("Phi_errors.0.0", [1.0], "must be numbers of shape (n, 10, 2)"),
        ("Phi_errors.0.0.0", np.inf, "geometry.Phi_errors[0][0][0]: is inf, must be finite"),
        ("parts", [], "geometry.Phi_errors: has the shape (3, 10, 2), must have (n, 10, 0)"),
        ("parts.0.colour", [0.1, 0.2], "parts[0].colour: has the shape (2,), must have (3,)"),
        ("parts.0.colour.0", 200, "parts[0].colour[0]: is 200, must be from 0 to 1"),
        ("parts.0.colour_sd", -1.0, "parts[0].colour_sd: is -1.0, must be from 0"),
        ("parts.0.sizes", [], "parts[0].sizes: is empty, must hold at least one length"),
        ("parts.0.sizes.0", 0.0, "parts[0].sizes[0]: is 0.0, must be from 0.0001 to 10 m"),
        ("parts.0.sizes.0", 50.0, "parts[0].sizes[0]: is 50.0, must be from 0.0001 to 10 m"),
        ("parts.0.position.2", -50.0, "parts[0].position[2]: is -50.0, must be from -10 to 10 m"),
        (
            "model.name",
            "webber",
            "model.name: is 'webber', must be one of weber, white, payload; did",
        ),
        ("model.weber_fraction", 7.0, "weber_fraction: is 7.0, must be from 0 to 1"),
        ("model.colour", 1.0, "model: does not fit weber"),
        ("num_samples", 0, "num_samples: is 0, must be from 1"),
        ("p_value", 1.5, "p_value: is 1.5, must be from 0 to 1"),
        ("log_evidence", np.nan, "log_evidence: is nan, must be from -1e+12 to 1e+12"),
        ("time", "noon", "time: is 'noon', must be a time such as"),
        ("time", "0001-01-01T00:00+12:00", "time: is '0001-01-01T00:00+12:00', must be a time such as"),
        ("id", "0", "id: is '0', must be '"),
        ("robott", "x", "robott: is not a key known here"),
    ],
)
def test_bad_value_in_a_record_is_refused_with_its_place(place, value, said):
    content = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, num_errors=3).to_dict()
    *way, last = (int(key) if key.isdigit() else key for key in place.split("."))
    within = content
    for key in way:
        within = within[key]
    within[last] = value
    assert said in refuse(parse_trial, Path("memory.jsonl"), "line 3", content)
