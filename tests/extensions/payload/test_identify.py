"""Generated runs of every kind, with known truth, friction, gains and correlated noise."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_pair, generate_run, rename
from numpy.testing import assert_allclose

from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.identify import Runs, identify
from affordance.extensions.payload.posterior.calibration import estimate_gains
from affordance.extensions.payload.posterior.log_cholesky import is_possible
from affordance.extensions.payload.posterior.payload_belief import describe_bodies
from affordance.extensions.payload.recording.preparation import prepare
from affordance.extensions.payload.settings import PRIORS, IdentificationSettings, SignalKind

_SETTINGS = IdentificationSettings(num_samples=1000)
_TORQUE = Truth(friction=(0.3, 0.2, 0.1), noise_sd=0.1)
_CURRENT = Truth(gain=0.1, load_friction=0.06, friction=(2.0, 1.0, 0.5), noise_sd=0.2)


def _record(robot, rng, truth=_TORQUE, **more):
    empty, loaded = generate_pair(robot, rng, truth, **more)
    return Runs(loaded, (empty,))


def _assert_believes(belief, truth=PAYLOAD, mass_sd=0.1):
    """Mass and centre of mass within three standard deviations, these small enough to be of use."""
    described, m = describe_bodies(truth[None])[0], belief.marginals
    assert m.sd[0] < mass_sd
    assert (np.abs(m.mean[:4] - described[:4]) < 3.0 * m.sd[:4]).all()
    assert is_possible(belief.bodies.pi).all()
    assert is_possible(belief.parameters[None])[0]


def test_paired_torques(robot, rng):
    empty = generate_run(robot, None, truth=_TORQUE, rng=rng)
    loaded = generate_run(robot, PAYLOAD, truth=_TORQUE, rng=rng, start=3.0)
    belief = identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS)
    _assert_believes(belief)
    assert belief.fit.evidence.source == belief.source
    assert abs(belief.fit.mode.pi[0] - belief.mass) < belief.mass_sd


def test_unpaired_torques_of_an_arm_that_is_not_as_its_file_says(robot, rng):
    truth = replace(_TORQUE, file_error=0.1)
    empty = generate_run(robot, None, truth=truth, rng=rng, duration=40.0)
    loaded = generate_run(robot, PAYLOAD, truth=truth, rng=rng, motion_seed=4, source="loaded")
    belief = identify(robot, Runs(loaded, (empty,)), paired=False, settings=_SETTINGS)
    _assert_believes(belief)
    assert "fitted" in belief.analysis


def test_two_empty_runs_are_better_than_one_of_them(robot, rng):
    truth = replace(_TORQUE, file_error=0.1)
    empty = [generate_run(robot, None, truth=truth, rng=rng, motion_seed=k, duration=15.0) for k in range(2)]
    loaded = generate_run(robot, PAYLOAD, truth=truth, rng=rng, motion_seed=4)
    both = identify(robot, Runs(loaded, tuple(empty)), paired=False, settings=_SETTINGS)
    _assert_believes(both)
    with pytest.raises(BadValueError, match="--empty: names 2 runs, must name one for a paired analysis"):
        identify(robot, Runs(loaded, tuple(empty)), settings=_SETTINGS)


def test_without_an_empty_run_the_file_decides_and_its_error_is_carried_over(robot, rng):
    loaded = generate_run(robot, PAYLOAD, truth=replace(_TORQUE, file_error=0.1), rng=rng)
    belief = identify(robot, Runs(loaded), settings=_SETTINGS)
    _assert_believes(belief, mass_sd=1.0)
    assert belief.mass_sd > 0.05
    assumed = " ".join(belief.assumptions)
    assert "file says: a gripper missing from the file counts as payload" in assumed
    assert "empty runs" not in assumed  # there are none
    certain = identify(robot, Runs(loaded), settings=replace(_SETTINGS, floor=False))
    assert certain.mass_sd < 0.5 * belief.mass_sd


def test_currents_with_gains_from_another_load(robot, rng):
    kind = SignalKind.CURRENT
    empty = generate_run(robot, None, truth=_CURRENT, rng=rng, kind=kind)
    weighed = generate_run(robot, 2.5 * PAYLOAD, truth=_CURRENT, rng=rng, kind=kind)
    calibrated = identify(robot, Runs(weighed, (empty,)), reference_mass=2.5 * PAYLOAD[0], settings=_SETTINGS)
    assert calibrated.calibration is not None
    assert calibrated.mass == pytest.approx(2.5 * PAYLOAD[0], rel=1e-3)
    assert calibrated.mass_sd == pytest.approx(1e-3 * 2.5 * PAYLOAD[0], rel=0.3)  # the scale's
    loaded = generate_run(robot, PAYLOAD, truth=_CURRENT, rng=rng, kind=kind, source="loaded")
    belief = identify(robot, Runs(loaded, (empty,)), gains=calibrated.calibration, settings=_SETTINGS)
    _assert_believes(belief)


def test_currents_without_a_weighed_load_are_known_to_a_fifth(robot, rng):
    belief = identify(robot, _record(robot, rng, _CURRENT, kind=SignalKind.CURRENT), settings=_SETTINGS)
    _assert_believes(belief, mass_sd=0.4)
    assert belief.mass_sd > 0.15 * belief.mass
    assert any("a weighed load would give 2 %" in sentence for sentence in belief.assumptions)


def test_a_heavy_load_without_an_empty_run_is_not_taken_for_larger_gains(robot, rng):
    payload = 4.0 * PAYLOAD
    loaded = generate_run(robot, payload, truth=_CURRENT, rng=rng, kind=SignalKind.CURRENT)
    belief = identify(robot, Runs(loaded), settings=_SETTINGS)
    low, high = belief.mass_interval90
    assert low < payload[0] < high
    # The gains by the arm's own weight alone have the load in them.
    own = estimate_gains(robot, loaded, prepare(loaded, _SETTINGS), _SETTINGS)
    assert own.mean[1, 0] > 1.15 * _CURRENT.gain
    assert abs(belief.gains[1, 0] / _CURRENT.gain - 1.0) < 0.5 * (own.mean[1, 0] / _CURRENT.gain - 1.0)


def test_a_wrist_sensor_with_a_gripper_that_is_tared(robot, rng):
    truth = Truth(noise_sd=0.3, friction=(0.0, 0.0, 4.0))
    gripper = 0.7 * PAYLOAD
    empty = generate_run(robot, gripper, truth=truth, rng=rng, kind=SignalKind.WRENCH)
    loaded = generate_run(robot, gripper + PAYLOAD, truth=truth, rng=rng, kind=SignalKind.WRENCH, motion_seed=2)
    belief = identify(robot, Runs(loaded, (empty,)), settings=_SETTINGS)
    _assert_believes(belief)
    assert "tared" in belief.analysis


@pytest.mark.parametrize("leaves_inertia", [False, True])
def test_what_the_controller_took_out_is_put_back(robot, rng, leaves_inertia):
    loaded = generate_run(robot, PAYLOAD, truth=_TORQUE, rng=rng, speed=2.0)
    empty = generate_run(robot, None, truth=_TORQUE, rng=rng, speed=2.0)
    taken = 0.5 * PAYLOAD
    moves = 1.0 - leaves_inertia
    motion = loaded.q, moves * loaded.v, moves * np.gradient(loaded.v, loaded.times, axis=0)
    torque = robot.compute_payload_regressors(*motion) @ taken + robot.compute_arm_torques(*motion)
    compensated = rename(
        replace(loaded, signal=loaded.signal - torque),
        compensated_payload=taken,
        compensates_arm=True,
        leaves_inertia=leaves_inertia,
    )
    _assert_believes(identify(robot, Runs(compensated, (empty,)), settings=_SETTINGS))


@pytest.mark.parametrize("fields", [("change_common_sd", "change_own_sd"), ("friction_sd",), None])
def test_of_what_is_certain_more_is_claimed(robot, rng, fields):
    truth = replace(_CURRENT, friction=(3.0, 2.0, 1.0), gain=1.0)
    runs = _record(robot, rng, truth, kind=SignalKind.MOTOR_TORQUE)
    surer = replace(_SETTINGS, correlated_noise=False)
    if fields is not None:
        certain = replace(PRIORS[SignalKind.MOTOR_TORQUE], **dict.fromkeys(fields, 0.0))
        surer = replace(_SETTINGS, signal_prior=certain)
    without, everything = (identify(robot, runs, settings=settings) for settings in (surer, _SETTINGS))
    assert without.mass_sd < everything.mass_sd
    assert without.assumptions != everything.assumptions


def test_a_slow_motion_says_so(robot, rng):
    belief = identify(robot, _record(robot, rng, Truth(noise_sd=0.3)), settings=_SETTINGS)
    assert any(
        "moments of inertia" in sentence and "known only to a factor" in sentence for sentence in belief.unseen
    )
    assert not any(sentence.startswith("mass") for sentence in belief.unseen)


def test_a_wrong_reference_mass_is_noticed(robot, rng):
    runs = _record(robot, rng)
    assert not identify(robot, runs, reference_mass=PAYLOAD[0], settings=_SETTINGS).warnings
    wrong = identify(robot, runs, reference_mass=2.0 * PAYLOAD[0], settings=_SETTINGS)
    assert "is outside the 90 % interval" in wrong.warnings[0]


def test_runs_that_do_not_belong_together_are_refused(robot, rng):
    torque, current = (
        generate_run(robot, None, truth=_TORQUE, rng=rng, kind=kind, source=kind.value)
        for kind in (SignalKind.JOINT_TORQUE, SignalKind.CURRENT)
    )
    with pytest.raises(BadValueError, match="current: signal: is current, must be joint_torque as in the loaded run"):
        identify(robot, Runs(torque, (current,)))
    with pytest.raises(BadValueError, match=r"gravity: is \(0.0, 0.0, 9.81\), must be \(0.0, 0.0, -9.81\)"):
        identify(robot, Runs(torque, (rename(torque, gravity=(0.0, 0.0, 9.81)),)))


def test_what_a_wrist_sensor_would_not_use_is_refused(robot, rng):
    empty = generate_run(robot, 0.5 * PAYLOAD, truth=_TORQUE, rng=rng, kind=SignalKind.WRENCH, source="empty")
    loaded = generate_run(robot, PAYLOAD, truth=_TORQUE, rng=rng, kind=SignalKind.WRENCH, source="loaded")
    with pytest.raises(BadValueError, match="--empty: names 2 runs, must name one for a wrist sensor's tare"):
        identify(robot, Runs(loaded, (empty, empty)), paired=False, settings=_SETTINGS)
    gains = build_nominal_gains(robot.joint_names, SignalKind.CURRENT, _SETTINGS)
    with pytest.raises(BadValueError, match="empty: signal: is wrench, must be current as for the gains"):
        identify(robot, Runs(loaded, (empty,)), gains=gains, settings=_SETTINGS)


def test_an_arm_at_rest_says_nothing_of_friction(robot, rng):
    run = generate_run(robot, PAYLOAD, truth=_TORQUE, rng=rng)
    still = replace(run, q=np.full_like(run.q, 0.4), v=np.zeros_like(run.q))
    with pytest.raises(BadValueError, match=r"v: never exceeds 0.03 rad/s at any joint.* \(--min-speed 0"):
        identify(robot, Runs(still))


def test_same_seed_same_belief(robot, rng):
    loaded = generate_run(robot, PAYLOAD, truth=_TORQUE, rng=rng)
    one, other = (identify(robot, Runs(loaded), settings=_SETTINGS) for _ in range(2))
    assert_allclose(one.bodies.pi, other.bodies.pi, rtol=0.0, atol=0.0)
