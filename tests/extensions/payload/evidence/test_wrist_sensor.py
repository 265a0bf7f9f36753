import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run

from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.evidence.wrist_sensor import (
    build_wrist_evidence,
    compute_force_regressors,
    find_tilt,
)
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS, Run, RunDescription
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, IdentificationSettings, SignalKind
from studies.payload.at_rest import SYMMETRIC, draw_postures, generate_slow_wrench, generate_wrench

_GRIPPER = 0.7 * PAYLOAD
_FAST = IdentificationSettings(num_samples=1000)


def test_a_tare_takes_the_gripper_and_the_offset_off(robot):
    """Offsets of 4 N and 4 N m are removed to 0.1, and the phantom is the gripper within four standard deviations."""
    runs = []
    for seed, load in enumerate((_GRIPPER, _GRIPPER + PAYLOAD)):
        truth, rng = Truth(noise_sd=0.05, friction=(0.0, 0.0, 4.0)), np.random.default_rng(seed)
        runs.append(generate_run(robot, load, truth=truth, rng=rng, kind=SignalKind.WRENCH, motion_seed=seed))
    gains = build_nominal_gains(WRENCH_COLUMNS, SignalKind.WRENCH, DEFAULT_SETTINGS)
    evidence = build_wrist_evidence(robot, runs[1], runs[:1], gains, DEFAULT_SETTINGS)
    wrench = robot.compute_wrench_regressors(*evidence.prepared.motion) @ (_GRIPPER + PAYLOAD)
    left = evidence.samples.signal - wrench[:, [3, 4, 5, 0, 1, 2]]
    assert np.abs(left.mean(axis=0)).max() < 0.1  # of 4 N and 4 N m
    sd = np.sqrt(np.diag(evidence.phantom_covariance))
    assert (np.abs(evidence.phantom - _GRIPPER) < 4.0 * sd).all()
    assert sd[0] < 0.05


def _hold(robot, rng, tilt_deg, num=12):
    q = draw_postures(num, 6, rng)
    signal = generate_wrench(robot, q, PAYLOAD, rng, tilt_deg)
    description = RunDescription(robot.joint_names, SignalKind.WRENCH, postures=True)
    return Run("held", description, 0.5 * np.arange(num), q, signal)


def test_the_tilt_of_a_base_is_found_and_its_length_kept(robot, rng):
    run = _hold(robot, rng, 2.0)
    tilt = find_tilt(robot, run)
    assert np.linalg.norm(tilt.gravity) == pytest.approx(9.81)
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


@pytest.mark.parametrize("seed", range(4))
def test_the_centre_of_a_nearly_symmetric_tool_is_found_in_a_slow_narrow_motion(seed):
    """Its moment about the axis is so small that a gain of zero explains it; that fit puts the centre 5 cm off."""
    wrist, run = generate_slow_wrench(SYMMETRIC, np.random.default_rng(seed))
    belief = identify(wrist, Runs(run), settings=_FAST)
    assert np.abs(belief.marginals.mean[1:4] - SYMMETRIC[1:4] / SYMMETRIC[0]).max() < 0.003
    assert np.abs(belief.gains[:, 0] - 1.0).max() < 0.05
