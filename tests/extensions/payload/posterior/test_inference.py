from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_pair, generate_run

from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.evidence.paired_runs import pair_runs
from affordance.extensions.payload.evidence.wrist_sensor import build_wrist_evidence
from affordance.extensions.payload.posterior.inference import list_assumptions
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, SignalKind


@pytest.fixture(scope="module")
def of_joints(robot):
    return pair_runs(robot, *generate_pair(robot, np.random.default_rng(0), Truth(), duration=8.0), DEFAULT_SETTINGS)


def test_what_is_assumed_of_joints_is_said(of_joints, gains):
    exact = replace(of_joints, phantom_covariance=np.zeros((10, 10)))
    said = list_assumptions(exact, gains, DEFAULT_SETTINGS)
    assert said[0].startswith("signal: joint torque [N m]; paired")
    assert "gains: the signal is a torque; gains known to 1 % in common and 2 % each" in said
    assert "friction that grows with the load: none" in said
    assert "friction (direction, velocity) and offset: +-0.3 N m" in said
    assert "change of gains since the empty run: +-0.2 % in common and +-0.2 % each" in said
    assert "error of the arm's model: none, it cancels" in said
    heavy = np.diag([0.05**2, *np.zeros(9)])
    said = list_assumptions(replace(of_joints, phantom_covariance=heavy), gains, DEFAULT_SETTINGS)
    assert "error of the arm and friction models that does not average out: 50 g at the tip" in said


def test_what_is_assumed_of_a_wrist_sensor_is_said(robot):
    run = generate_run(
        robot, PAYLOAD, truth=Truth(), rng=np.random.default_rng(0), kind=SignalKind.WRENCH, duration=8.0
    )
    gains = build_nominal_gains(WRENCH_COLUMNS, SignalKind.WRENCH, DEFAULT_SETTINGS)
    evidence = build_wrist_evidence(robot, run, (), gains, DEFAULT_SETTINGS)
    said = list_assumptions(evidence, gains, DEFAULT_SETTINGS)
    # Twenty times what an offset drifts by, 3 N.
    assert "offsets: +-60 N, and a tenth of that in N m" in said
    assert not any("friction" in sentence for sentence in said)
