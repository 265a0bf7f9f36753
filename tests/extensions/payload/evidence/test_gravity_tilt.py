import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD
from helpers.held_postures import draw_postures, generate_wrench

from affordance.extensions.payload.evidence.gravity_tilt import compute_force_regressors, find_tilt
from affordance.extensions.payload.recording.run import Run, RunDescription
from affordance.extensions.payload.settings import SignalKind


def _hold(robot, rng, tilt_deg, num=12):
    q = draw_postures(num, rng)
    signal = generate_wrench(robot, q, PAYLOAD, rng, tilt_deg)
    description = RunDescription(robot.joint_names, SignalKind.WRENCH, postures=True)
    return Run("held", description, 0.5 * np.arange(num), q, signal)


def test_the_tilt_of_a_base_is_found_and_its_length_kept(robot, rng):
    run = _hold(robot, rng, 2.0)
    tilt = find_tilt(robot, run)
    assert np.linalg.norm(tilt.gravity) == pytest.approx(9.81)
    assert np.degrees(tilt.apparent) == pytest.approx(2.0, abs=4.0 * np.degrees(tilt.apparent_sd))
    assert np.degrees(tilt.apparent_sd) < 1.0
    assert tilt.gravity @ tilt.described < tilt.described @ tilt.described


def test_errors_of_the_load_are_those_that_another_tilt_would_make(robot, rng):
    run = _hold(robot, rng, 1.0)
    tilt = find_tilt(robot, run)
    tilted = robot.with_gravity(tilt.gravity)
    covariance = tilt.measure_errors(tilted, compute_force_regressors(tilted, run.q), run.signal, run.q)
    sd = np.sqrt(np.diag(covariance))
    assert 0.0 < sd[0] < 0.01 * PAYLOAD[0]
    assert 1e-5 < np.linalg.norm(sd[1:4]) < 0.02  # kg m; a degree of 1.2 kg at 8 cm is 1.7e-3
    assert not covariance[4:].any()
