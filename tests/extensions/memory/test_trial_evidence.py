"""Records of trials: a written record reads as the same, and bad evidence is refused in a line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.trials import PLAIN, STEEL, WOOD, hold

from affordance.belief.likelihood import Quadratic
from affordance.exceptions import BadArgumentError
from affordance.extensions.memory.trial_evidence import PayloadQuadratic, TrialEvidence, pack, read_record, read_time
from affordance.objects.inertia import Geometry
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

_TRIAL = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, num_errors=3)


@pytest.mark.parametrize("model", [PLAIN, WeberNoise(0.05, 0.2, independent_samples=True), WhiteNoise(0.3)])
def test_a_record_reads_as_what_was_written(model):
    trial = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, model=model, num_errors=3)
    again = read_record(Path("memory"), "trial", json.dumps(trial.to_dict()))
    assert again.to_dict() == trial.to_dict()
    assert again.model == model
    assert np.array_equal(again.geometry.Phi_errors, trial.geometry.Phi_errors)
    for one, other in zip(again.describe(trial.geometry).hold, trial.describe(trial.geometry).hold, strict=True):
        assert np.array_equal(one, other)


def test_a_record_of_whole_numbers_reads_as_that_of_floats():
    """Also numbers of the model, of parts, and of arrays."""
    floats = hold("hammer", ((1.0, 0.0, 0.0), STEEL), (650.0, 7700.0), 5, model=WhiteNoise(1.0))
    parts = (floats.parts[0]._replace(colour=(1, 0, 0), colour_sd=0, sizes=(1, 1, 1)), floats.parts[1])
    floats = replace(floats, parts=(floats.parts[0]._replace(sizes=(1.0, 1.0, 1.0)), floats.parts[1]))
    whole = replace(floats, parts=parts, model=WhiteNoise(1), log_evidence=0, p_value=1)
    assert whole.to_dict() == floats.to_dict()
    assert read_record(Path("memory"), "trial", json.dumps(whole.to_dict())).digest == whole.digest


def test_a_recording_counts_once_whatever_was_made_of_it():
    one = replace(_TRIAL, source_hash="abc")
    assert one.id == replace(one, features=2.0 * one.features, object_name="other").id != _TRIAL.id
    assert _TRIAL.id != replace(_TRIAL, features=2.0 * _TRIAL.features).id
    assert _TRIAL.id == replace(_TRIAL, time="2027-01-01", robot="other").id


def test_a_precision_that_is_none_is_refused():
    good = np.diag([1.0, *[0.0] * 9])
    for precision, message in (
        (good - 0.1 * np.eye(10), "must be positive semidefinite"),
        (good + np.eye(10, k=1), "is not symmetric"),
    ):
        with pytest.raises(BadArgumentError, match=message):
            replace(_TRIAL, model=PayloadQuadratic(), features=pack(Quadratic(precision, np.zeros(10))))
    assert isinstance(
        replace(_TRIAL, model=PayloadQuadratic(), features=pack(Quadratic(good, np.zeros(10)))), TrialEvidence
    )


def test_shapes_of_geometry_are_checked():
    with pytest.raises(BadArgumentError, match=r"geometry\.Phi: has the shape"):
        replace(_TRIAL, geometry=Geometry(np.ones((10, 3)), np.zeros((0, 10, 3))))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("2026-03-01", "2026-03-01T00:00:00.000000Z"),
        ("2026-03-01T12:00+02:00", "2026-03-01T10:00:00.000000Z"),
        ("2026-03-01T12:00:00.5Z", "2026-03-01T12:00:00.500000Z"),
    ],
)
def test_times_sort_as_texts(text, shown):
    assert read_time("since", text) == shown


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"features": 1e150 * _TRIAL.features}, r"features\[0\]: is .*e\+15\d, must be from -1e\+06 to 1e\+06"),
        ({"model": WhiteNoise(), "features": np.full(111, 1e16)}, r"features\[0\]: is 1e\+16, must be from -1e\+15"),
        (
            {"model": PayloadQuadratic(), "features": np.full(110, 1e22)},
            r"features\[0\]: is 1e\+22, must be from -1e\+21",
        ),
        (
            {"geometry": Geometry(np.full((10, 2), 1e8), np.zeros((0, 10, 2)))},
            r"geometry\.Phi\[0\]\[0\]: is 1e\+08, must be",
        ),
        (
            {"geometry": Geometry(np.zeros((10, 2)), np.zeros((0, 10, 2)))},
            r"Phi\[0\]\[0\]: is 0, must be from 1e-15",
        ),
        ({"geometry": Geometry(np.ones((10, 2)), np.full((1, 10, 2), 1e8))}, r"Phi_errors\[0\]\[0\]\[0\]: is 1e\+08"),
        (
            {"parts": (_TRIAL.parts[0]._replace(position=(10.1, 0.0, 0.0)),) * 2},
            r"parts\[0\]\.position\[0\]: is 10.1, must",
        ),
        ({"parts": (_TRIAL.parts[0]._replace(sizes=(11.0,)),) * 2}, r"parts\[0\]\.sizes\[0\]: is 11, must be from"),
        (
            {"parts": (_TRIAL.parts[0]._replace(size_sd=1e9),) * 2},
            r"parts\[0\]\.size_sd: is 1000000000.0, must be from 0",
        ),
        ({"parts": ("oak", "steel")}, r"parts\[0\]: is of type str, must be of type PartAppearance"),
        ({"time": "0001-01-01"}, "time: is '0001-01-01', must be in 1970 or later"),
        ({"log_evidence": -1e13}, r"log_evidence: is -10000000000000.0, must be from -1e\+12 to 1e\+12"),
        ({"object_name": 3}, "object_name: is 3, must be a non-empty text"),
        ({"object_name": "\x1b[2J"}, r"object_name: is '.x1b\[2J', must be without the hidden character U\+001B"),
        ({"robot": "a\r\nb"}, r"robot: is 'a.r.nb', must be without the hidden character U\+000D"),
        ({"robot": "n" * 501}, "robot: has 501 characters, must have at most 500"),
        ({"source": "\u202e"}, r"source: is '.u202e', must be without the hidden character U\+202E"),
        ({"fingerprint": None}, "fingerprint: is empty, must be a non-empty text"),
    ],
)
def test_what_no_robot_feels_or_no_reader_sees_is_refused(changes, message):
    with pytest.raises(BadArgumentError, match=message):
        replace(_TRIAL, **changes)


def test_evidence_does_not_change_with_the_arrays_that_it_was_made_of():
    features = _TRIAL.features.copy()
    trial = replace(_TRIAL, features=features)
    features[0] = np.nan
    assert trial.digest == _TRIAL.digest
    with pytest.raises(ValueError, match="read-only"):
        trial.features[0] = 0.0


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("features.3", np.nan, "memory.jsonl: line 3.features[3]: is nan, must be finite"),
        ("features", [1.0], "features: has the shape (1,), must have (84,)"),
        ("features", "1", "features: is '1', must be"),
        ("Phi", [[1.0, 1.0]], "geometry.Phi: has the shape (1, 2), must have (10, 2)"),
        ("Phi.0", [1.0], "must be numbers of shape (10, 2)"),
        ("Phi.0.1", -0.001, "geometry.Phi[0][1]: is -0.001, must be from 1e-15 to 1e+07 m^3"),
        ("Phi_errors.0.0", [1.0], "must be numbers of shape (n, 10, 2)"),
        ("Phi_errors.0.0.0", np.inf, "geometry.Phi_errors[0][0][0]: is inf, must be finite"),
        ("parts", [], "geometry.Phi_errors: has the shape (3, 10, 2), must have (n, 10, 0)"),
        ("parts.0.colour", [0.1, 0.2], "parts[0].colour: has the shape (2,), must have (3,)"),
        ("parts.0.colour.0", 200, "parts[0].colour[0]: is 200, must be from 0 to 1"),
        ("parts.0.colour_sd", -1.0, "parts[0].colour_sd: is -1.0, must be from 0"),
        ("parts.0.sizes", [], "parts[0].sizes: is empty, must hold at least one length"),
        ("parts.0.sizes.0", 0.0, "parts[0].sizes[0]: is 0, must be from 0.0001 to 10 m"),
        ("parts.0.sizes.0", 50.0, "parts[0].sizes[0]: is 50, must be from 0.0001 to 10 m"),
        ("parts.0.position.2", -50.0, "parts[0].position[2]: is -50, must be from -10 to 10 m"),
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
    assert said in refuse(read_record, Path("memory.jsonl"), "line 3", json.dumps(content))
