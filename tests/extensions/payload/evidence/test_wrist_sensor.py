import numpy as np
from helpers.generated_runs import PAYLOAD, Truth, generate_run

from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.evidence.wrist_sensor import build_wrist_evidence
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, SignalKind

_GRIPPER = 0.7 * PAYLOAD


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
