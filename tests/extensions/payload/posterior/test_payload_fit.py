from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, Truth, generate_pair, generate_run
from numpy.testing import assert_allclose

from affordance.extensions.payload.evidence.gains import build_nominal_gains
from affordance.extensions.payload.evidence.paired_runs import pair_runs
from affordance.extensions.payload.evidence.wrist_sensor import build_wrist_evidence
from affordance.extensions.payload.posterior import payload_fit
from affordance.extensions.payload.posterior.payload_fit import (
    add_friction_error,
    build_channel_prior,
    estimate_changes,
    fit_payload,
    measure_axes,
    spread_gains,
)
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.recording.run import WRENCH_COLUMNS
from affordance.extensions.payload.settings import DEFAULT_SETTINGS, PRIORS, SignalKind
from affordance.extensions.robots.recorded_arm import load_robot
from studies.payload.at_rest import WRIST, draw_postures, generate_wrench, hold


def test_body_and_noise_settle_in_a_few_rounds_each_as_the_other_says(robot, gains, monkeypatch):
    runs = generate_pair(robot, np.random.default_rng(4), Truth(noise_sd=0.1))
    evidence = pair_runs(robot, *runs, DEFAULT_SETTINGS)
    rounds, improve = [], payload_fit.improve_mode
    monkeypatch.setattr(payload_fit, "improve_mode", lambda *args: rounds.append(args) or improve(*args))
    fit = fit_payload(
        evidence, build_channel_prior(evidence, gains, DEFAULT_SETTINGS), SolidPrior.for_hand(), DEFAULT_SETTINGS
    )
    assert len(rounds) < 25
    errors = evidence.build_error_model(DEFAULT_SETTINGS)
    weights = fit.likelihood.build_residual_weights(fit.mode.load)
    assert_allclose(fit.long_run_variance, errors.estimate_variance(fit.statistics, weights), rtol=1e-3)
    # Two runs of white noise of 0.1 N m that agrees over 0.3 s, at 100 samples a second.
    assert fit.long_run_variance.mean() == pytest.approx(2.0 * 0.1**2 * 30.0, rel=0.4)


@pytest.mark.parametrize("count", [1, 4, 60])
def test_joint_that_hardly_moves_says_little_in_place_of_everything(robot, gains, rng, count):
    """A joint with 1, 4 or 60 samples has an error no smaller than its signal, and the mass is right to 5 %."""
    evidence = pair_runs(robot, *generate_pair(robot, rng, Truth(noise_sd=0.1)), DEFAULT_SETTINGS)
    used = evidence.samples.used.copy()
    used[:, -1] = np.arange(len(used)) < count
    brief = replace(evidence, samples=evidence.samples._replace(used=used))
    prior = build_channel_prior(evidence, gains, DEFAULT_SETTINGS)
    fit = fit_payload(brief, prior, SolidPrior.for_hand(), DEFAULT_SETTINGS)
    assert fit.long_run_variance[-1] >= (evidence.samples.signal[:count, -1] ** 2).mean()
    assert fit.mode.pi[0] == pytest.approx(PAYLOAD[0], rel=0.05)


def test_error_of_friction_scales_with_what_friction_does(robot, gains):
    """Errors of mass and first moment are twice as large for twice the friction, which only the loaded run has."""
    solid, sds = SolidPrior.for_hand(), []
    same = replace(PRIORS[SignalKind.JOINT_TORQUE], change_common_sd=0.0, change_own_sd=0.0)
    settings = replace(DEFAULT_SETTINGS, signal_prior=same)
    exact = replace(gains, covariance=np.zeros_like(gains.covariance))
    for friction in (0.0, 0.3, 0.6):
        rng = np.random.default_rng(7)
        truths = Truth(noise_sd=0.002), Truth(noise_sd=0.002, friction=(friction, 0.0, 0.0))
        empty, loaded = (
            generate_run(robot, pi, truth=truth, rng=rng) for pi, truth in zip((None, PAYLOAD), truths, strict=True)
        )
        evidence = pair_runs(robot, empty, loaded, settings)
        widened = add_friction_error(evidence, exact, solid, settings)
        variance = np.diag(widened.phantom_covariance - evidence.phantom_covariance)
        sds.append(np.sqrt([variance[0], variance[1:4].sum()]))  # mass and first moment
        assert add_friction_error(evidence, exact, solid, replace(settings, floor=False)) is evidence
    assert (sds[0] < 0.5 * sds[1]).all()  # what noise alone makes of it
    assert_allclose(sds[2], 2.0 * sds[1], rtol=0.2)


@pytest.mark.parametrize("gain_sd", [0.0, 0.03])
def test_spread_of_a_wrist_sensors_gains_is_that_of_samples_weighted_by_how_their_axes_differ(gain_sd, rng):
    """Variances are drawn from the prior, and weighted by the density of the axes' two differences."""
    wrist = load_robot(*WRIST)
    q = draw_postures(30, wrist.num_joints, rng)
    run = hold(wrist, q, generate_wrench(wrist, q, PAYLOAD, rng, gain_sd=gain_sd), SignalKind.WRENCH)
    nominal = build_nominal_gains(WRENCH_COLUMNS, SignalKind.WRENCH, DEFAULT_SETTINGS)
    evidence = build_wrist_evidence(wrist, run, (), nominal, DEFAULT_SETTINGS)
    prior = build_channel_prior(evidence, nominal, DEFAULT_SETTINGS)
    fit = fit_payload(evidence, prior, SolidPrior.for_hand(), DEFAULT_SETTINGS)
    scale, error = measure_axes(fit)
    drawn = 1.0 / rng.chisquare(1.0, 400_000)
    of_each = drawn[:, None] * nominal.covariance[0, 0, 0] + error**2
    differ = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])
    covariance = np.einsum("ij,nj,kj->nik", differ, of_each, differ)
    distance = np.einsum("i,nij,j->n", differ @ scale, np.linalg.inv(covariance), differ @ scale)
    weights = np.exp(-0.5 * distance) / np.sqrt(np.linalg.det(covariance))
    order = np.argsort(drawn)
    below = np.cumsum(weights[order]) / weights.sum()
    expected = np.interp((np.arange(8) + 0.5) / 8.0, below, drawn[order])
    assert_allclose(spread_gains(fit), expected, rtol=0.05)


def test_changes_of_gains_are_those_of_the_data_and_err_as_stated(robot, gains):
    """Changes by 10 and -5 % are not shrunk to a prior of zero, and err in 20 pairs as much as is stated."""
    solid, errors, stated = SolidPrior.for_hand(), [], []
    same = replace(PRIORS[SignalKind.JOINT_TORQUE], change_common_sd=0.0, change_own_sd=0.0)
    settings = replace(DEFAULT_SETTINGS, signal_prior=same)
    exact = replace(gains, covariance=np.zeros_like(gains.covariance))
    for seed in range(20):
        empty, loaded = generate_pair(robot, np.random.default_rng(seed), Truth(noise_sd=0.1))
        torque = robot.compute_arm_torques(loaded.q, loaded.v, np.gradient(loaded.v, loaded.times, axis=0))
        changed = replace(loaded, signal=loaded.signal + torque * [0.0, 0.1, -0.05, 0.0, 0.0, 0.0])
        evidence = pair_runs(robot, empty, changed, settings)
        fit = fit_payload(evidence, build_channel_prior(evidence, exact, settings), solid, settings)
        change, covariance = estimate_changes(fit, solid, settings)
        errors.append(change[1:3] - [0.1, -0.05])
        stated.append(np.sqrt(np.diag(covariance))[1:3])
    assert_allclose(np.mean(errors, axis=0), 0.0, atol=3.0 * np.mean(stated) / np.sqrt(20))
    assert np.mean(stated) < 0.03
    assert np.sqrt(np.mean((np.array(errors) / stated) ** 2)) == pytest.approx(1.0, abs=0.4)
