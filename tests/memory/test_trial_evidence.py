"""Records of trials: a written record reads as the same, and bad evidence is refused in a line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.trials import PLAIN, STEEL, WOOD, hold

from affordance.belief.likelihood import Quadratic
from affordance.exceptions import BadArgumentError
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


def test_a_record_of_whole_numbers_reads_as_that_of_floats():
    """Also numbers of the model, of parts, and of arrays."""
    floats = hold("hammer", ((1.0, 0.0, 0.0), STEEL), (650.0, 7700.0), 5, model=WhiteNoise(1.0))
    parts = (floats.parts[0]._replace(colour=(1, 0, 0), colour_sd=0, sizes=(1, 1, 1)), floats.parts[1])
    floats = replace(floats, parts=(floats.parts[0]._replace(sizes=(1.0, 1.0, 1.0)), floats.parts[1]))
    whole = replace(floats, parts=parts, model=WhiteNoise(1), log_evidence=0, p_value=1)
    assert whole.to_dict() == floats.to_dict()
    assert parse_trial(Path("memory"), "trial", whole.to_dict()).digest == whole.digest


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
