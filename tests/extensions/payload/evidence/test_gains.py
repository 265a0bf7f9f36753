import json
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_run
from helpers.refusals import refuse
from numpy.testing import assert_allclose

from affordance.extensions.payload.evidence.gains import arrange_gains, build_nominal_gains, read_gains, write_gains
from affordance.extensions.payload.evidence.paired_runs import pair_runs
from affordance.extensions.payload.posterior import calibration
from affordance.extensions.payload.posterior.calibration import calibrate_gains, check_halves
from affordance.extensions.payload.posterior.log_cholesky import parameters_from_theta
from affordance.extensions.payload.posterior.payload_fit import fit_payload
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, PRIORS, SignalKind

_TRUTH = Truth(gain=0.1, load_friction=0.08, friction=(2.0, 1.0, 0.5), noise_sd=0.2)


@pytest.fixture(scope="module")
def evidence(robot):
    rng = np.random.default_rng(3)
    kind = SignalKind.CURRENT
    empty = generate_run(robot, None, truth=_TRUTH, rng=rng, kind=kind, duration=30.0)
    loaded = generate_run(robot, PAYLOAD, truth=_TRUTH, rng=rng, kind=kind, duration=30.0, start=5.0)
    return pair_runs(robot, empty, loaded, DEFAULT_SETTINGS)


def test_gains_and_load_friction_are_found_from_a_weighed_load(evidence):
    # Gains of both runs are the same here.
    same = replace(PRIORS[SignalKind.CURRENT], change_common_sd=0.0, change_own_sd=0.0)
    gains = calibrate_gains(evidence, PAYLOAD[0], replace(DEFAULT_SETTINGS, signal_prior=same))
    sd = np.sqrt(gains.covariance[:, 0, 0])
    # Joints that lift the load; those of the wrist hardly feel it.
    for joint in (1, 2):
        assert abs(gains.mean[joint, 0] - 0.1) < 3.0 * sd[joint]
        assert sd[joint] < 0.005
        assert gains.load_friction[joint] == pytest.approx(0.08, abs=0.03)
    assert (np.abs(gains.mean[:, 0] - 0.1) < 4.0 * sd).all()


def test_each_half_weighs_the_other(evidence):
    halves = check_halves(evidence, PAYLOAD[0], DEFAULT_SETTINGS)
    assert (halves.inside == 1.0).all()
    assert (np.abs(halves.error) < 0.05).all()
    assert_allclose(halves.mass, PAYLOAD[0] * (1.0 + halves.error))


def test_gains_are_read_as_they_were_written(evidence, tmp_path):
    gains = calibrate_gains(evidence, PAYLOAD[0], DEFAULT_SETTINGS)
    write_gains(tmp_path / "gains.yaml", gains)
    again = read_gains(tmp_path / "gains.yaml")
    assert again.joint_names == gains.joint_names
    assert again.kind is SignalKind.CURRENT
    for name in ("mean", "covariance", "least_variance"):
        assert_allclose(getattr(again, name), getattr(gains, name), rtol=1e-12)
    assert again.friction_sd is None  # a second run took friction off


def test_gains_drift_from_run_to_run():
    nominal = build_nominal_gains(("a", "b"), SignalKind.MOTOR_TORQUE, DEFAULT_SETTINGS)
    drifted = nominal.with_drift(DEFAULT_SETTINGS)
    assert_allclose(drifted.covariance[:, 0, 0] - nominal.covariance[:, 0, 0], 0.005**2)
    assert_allclose(drifted.common_sd**2 - nominal.common_sd**2, 0.015**2)
    assert_allclose(drifted.covariance[:, 1, 1] - nominal.covariance[:, 1, 1], 0.02**2)


def test_gains_go_by_names_of_joints_and_cannot_be_changed_in_place():
    gains = build_nominal_gains(("a", "b"), SignalKind.CURRENT, DEFAULT_SETTINGS)
    assert repr(gains).startswith("Gains(current: a 1, b 1; ")
    with pytest.raises(FrozenInstanceError):
        gains.common_sd = 0.5
    assert arrange_gains(gains, ("b", "a"), "gains.yaml").joint_names == ("b", "a")
    assert "gains.yaml: joints: are a, b, must include c" in refuse(arrange_gains, gains, ("a", "c"), "gains.yaml")


def test_friction_goes_with_its_uncertainty_and_is_of_all_joints_or_of_none(tmp_path):
    gains = replace(
        build_nominal_gains(("a", "b"), SignalKind.CURRENT, DEFAULT_SETTINGS),
        friction=np.arange(6.0).reshape(2, 3),
        friction_sd=1.0 + np.arange(6.0).reshape(2, 3),
    )
    path = tmp_path / "gains.yaml"
    write_gains(path, gains)
    assert_allclose(read_gains(path).friction, gains.friction)
    written = json.loads(path.read_text())
    del written["joints"]["b"]["friction_sd"]
    path.write_text(json.dumps(written))
    assert "joints.b.friction_sd: is missing" in refuse(read_gains, path)
    del written["joints"]["b"]["friction"]
    path.write_text(json.dumps(written))
    assert "joints: give friction for 1 joints, must give it for all 2 or for none" in refuse(read_gains, path)


def test_gains_are_as_uncertain_as_the_body_they_come_from_makes_them(evidence, rng, monkeypatch):
    """SDs of gains agree to 6 % with the law of total variance over bodies drawn from the belief about the load."""
    fits = []
    monkeypatch.setattr(calibration, "fit_payload", lambda *args: fits.append(fit_payload(*args)) or fits[-1])
    found = calibrate_gains(evidence, PAYLOAD[0], DEFAULT_SETTINGS).covariance
    fit = fits[-1]
    root = np.linalg.cholesky(fit.mode.covariance)
    thetas = fit.mode.theta + 0.1 * rng.standard_normal((2000, 10)) @ root.T
    drawn = [fit.likelihood.estimate_gains(parameters_from_theta(theta)) for theta in thetas]
    given = np.mean([covariance for _, covariance in drawn], axis=0)
    between = 100.0 * np.array(
        [np.cov(gains.T) for gains in np.array([mean for mean, _ in drawn]).transpose(1, 0, 2)]
    )
    for joint in range(6):
        assert_allclose(np.sqrt(np.diag(found[joint])), np.sqrt(np.diag(given[joint] + between[joint])), rtol=0.06)
    # At some joints that is a good part of it.
    assert (between[:, 0, 0] > 0.3 * given[:, 0, 0]).any()


def test_friction_that_no_gear_makes_does_not_drift():
    nominal = build_nominal_gains(("a", "b"), SignalKind.JOINT_TORQUE, DEFAULT_SETTINGS)
    assert not nominal.with_drift(DEFAULT_SETTINGS).covariance[:, 1].any()


GAINS = """
source: 'the signal is a torque; gains known to 2 %'
robot: ''
signal: current
common_sd: 0.0
joints:
  a:
    gain: 1.0  # A per N m
    load_friction: 0.05
    covariance: [0.0004, 0.0, 0.0049]  # var(g), cov(g, h = mu g), var(h)
    noise_variance: 0.0
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("signal: current", "signal: amps", "signal: is 'amps', must be one of"),
        ("gain: 1.0", "gain: 0", "joints.a.gain: is 0, must not be 0"),
        (
            "covariance: [0.0004",
            "covariance: [-1",
            "joints.a.covariance: is [-1, 0, 0.0049], must be a covariance of two numbers",
        ),
        (
            "covariance: [0.0004, 0.0",
            "covariance: [0.0004, 1e300",
            "covariance[1]: is 1e+300, must be from -1e+12 to 1e+12",
        ),
        ("common_sd: 0.0", "common_sd: 2", "common_sd: is 2, must be from 0 to 1"),
    ],
)
def test_mistake_in_gains_is_refused(tmp_path, old, new, said):
    path = tmp_path / "gains.yaml"
    path.write_text(GAINS.replace(old, new))
    assert said in refuse(read_gains, path)
