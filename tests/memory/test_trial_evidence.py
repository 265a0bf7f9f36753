"""Records of trials: what is written reads as the same, and what is no evidence is refused in a line."""

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.trials import PLAIN, STEEL, WOOD, hold

from affordance.belief.quadratic import Quadratic
from affordance.exceptions import BadArgumentError, BadValueError
from affordance.memory.felt_models import PayloadQuadratic, pack
from affordance.memory.stored_trials import parse_trial
from affordance.memory.trial_evidence import TrialEvidence, read_time
from affordance.objects.inertia import Geometry
from affordance.proprioception.torque_noise import WeberNoise, WhiteNoise

_TRIAL = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, num_errors=3)


@pytest.mark.parametrize("model", [PLAIN, WeberNoise(0.05, 0.2, independent_samples=True), WhiteNoise(0.3)])
def test_a_record_reads_as_what_was_written(model):
    trial = hold("hammer", (WOOD, STEEL), (650.0, 7700.0), 5, model=model, num_errors=3)
    again = parse_trial(Path("memory"), "trial", trial.to_dict())
    assert again.to_dict() == trial.to_dict()
    assert again.model == model
    assert np.array_equal(again.geometry.Phi_errors, trial.geometry.Phi_errors)
    rho = np.array([600.0, 7000.0])
    for one, other in zip(
        again.compute_likelihood(trial.geometry, rho), trial.compute_likelihood(trial.geometry, rho), strict=True
    ):
        assert np.array_equal(one, other)


def test_a_recording_counts_once_whatever_was_made_of_it():
    one = replace(_TRIAL, source_hash="abc")
    assert one.id == replace(one, features=2.0 * one.features, object_name="other").id != _TRIAL.id
    assert _TRIAL.id != replace(_TRIAL, features=2.0 * _TRIAL.features).id
    assert _TRIAL.id == replace(_TRIAL, time="2027-01-01", robot="other").id


def _set(content, keys, value):
    content = copy.deepcopy(content)
    inner = content
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    return content


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("features", 3), float("nan"), r"features\[3\]: is nan|finite"),
        (("features",), [1.0], "features: has the shape"),
        (("features",), "1", "features: is '1', must be"),
        (("Phi",), [[1.0, 1.0]], "Phi: has the shape"),
        (("Phi", 0), [1.0], "Phi: "),
        (("Phi_errors", 0, 0), [1.0], "Phi_errors: "),
        (("Phi", 0, 1), -1e-3, r"Phi\[0\]\[1\]: is -0.001, must be a volume above 0 m\^3"),
        (("Phi_errors", 0, 0, 0), float("inf"), "finite"),
        (("parts", 0, "colour"), [0.1, 0.2], "colour: has the shape"),
        (("parts", 0, "colour", 0), 200, r"colour\[0\]: is 200, must be from 0 to 1"),
        (("parts", 0, "sizes"), [], "sizes: is \\[\\], must be lengths above 0 m"),
        (("parts", 0, "sizes", 0), 0.0, "must be lengths above 0 m"),
        (("parts", 0, "colour_sd"), -1.0, "colour_sd: is -1"),
        (("parts",), [], "parts: is empty|has the shape"),
        (("model", "name"), "webber", r"model.name: is 'webber', must be one of .*did you mean 'weber'"),
        (("model", "weber_fraction"), 7.0, "weber_fraction: is 7"),
        (("model", "colour"), 1.0, "model: does not fit weber"),
        (("num_samples",), 0, "num_samples: is 0, must be"),
        (("p_value",), 1.5, "p_value: is 1.5, must be from 0 to 1"),
        (("log_evidence",), float("nan"), "finite"),
        (("time",), "noon", "time: is 'noon', must be a time such as"),
        (("id",), "0", "id: is '0', must be '.*', the digest of the content"),
        (("robott",), "x", "robott: is not a key known here"),
    ],
)
def test_what_is_no_evidence_is_refused_in_a_line(keys, value, message):
    with pytest.raises(BadValueError, match=message) as caught:
        parse_trial(Path("memory.jsonl"), "line 3", _set(_TRIAL.to_dict(), keys, value))
    assert str(caught.value).startswith("memory.jsonl: line 3")
    assert "\n" not in str(caught.value)


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
