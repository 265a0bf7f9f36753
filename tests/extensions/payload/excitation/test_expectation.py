"""Prediction of the information in a motion, against identification itself and against dense algebra."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD, THETA

from affordance.extensions.payload.evidence.model_error import build_phantom_covariance
from affordance.extensions.payload.excitation.planned_motion import FourierFamily, list_times
from affordance.extensions.payload.posterior.log_cholesky import compute_jacobian
from affordance.extensions.payload.posterior.payload_fit import build_channel_prior, fit_payload
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.settings import PRIORS, SignalKind, SignalPrior
from studies.payload.at_rest import draw_errors


@pytest.fixture
def motion(expectation, limits):
    family = FourierFamily(expectation.robot, limits, 8.0)
    return family.build(family.draw(np.random.default_rng(1)), list_times(8.0))


def test_what_is_predicted_is_what_identification_states(expectation, limits, rng):
    family = FourierFamily(expectation.robot, limits, 20.0)
    numbers = family.draw(np.random.default_rng(1))
    evidence = expectation.build_evidence(family.build(numbers, list_times(20.0, 100.0))._replace(cutoff=20.0))
    noise = np.sqrt(0.01 / 0.3) * draw_errors(evidence.prepared.times, 6, 0.3, rng)  # with a density of .01 N^2 m^2 s
    felt = replace(evidence, samples=evidence.samples._replace(signal=evidence.samples.Y @ PAYLOAD + noise))
    prior = build_channel_prior(felt, expectation.gains, expectation.settings)
    fit = fit_payload(felt, prior, SolidPrior.for_hand(), expectation.settings)
    stated = np.sqrt(np.diag(fit.mode.covariance))
    predicted = expectation.predict(family.build(numbers, list_times(20.0)))
    assert predicted.mass == pytest.approx(stated[0] * fit.mode.pi[0], rel=0.15)
    assert predicted.com == pytest.approx(np.linalg.norm(stated[1:4]), rel=0.15)


@pytest.mark.parametrize("load_friction", [0.0, 0.1])
def test_prediction_agrees_with_dense_algebra(expectation, motion, load_friction):
    """The prediction agrees with a regression of all unknowns on all samples, with nothing integrated out."""
    kind = SignalKind.MOTOR_TORQUE
    gains = replace(
        expectation.gains,
        kind=kind,
        mean=np.tile([1.1, load_friction], (6, 1)),
        covariance=np.tile([[4e-4, 1e-4], [1e-4, 9e-4]], (6, 1, 1)),
        common_sd=0.0,
    )
    no_change = (0.0,) * 6  # of gains, which are those above
    prior = SignalPrior(*no_change, load_friction, 0.03, 0.3)
    settings = replace(expectation.settings, signal_prior=prior)
    known = replace(expectation, gains=gains, settings=settings)
    samples = known.build_evidence(motion).samples
    L = np.linalg.cholesky(gains.covariance[0])
    num, size = len(motion.times), 10 + 6 * 5 + 10
    rows = np.zeros((num, 6, size))
    load = samples.Y @ PAYLOAD
    rows[:, :, :10] = (1.1 + load_friction * samples.load_sign[..., None]) * samples.Y
    for j in range(6):
        s = samples.load_sign[:, j]
        own = slice(10 + 5 * j, 15 + 5 * j)
        rows[:, j, own][:, :2] = np.column_stack([load[:, j], s * load[:, j]]) @ L
        ones = np.ones(num)
        rows[:, j, own][:, 2:] = 0.3 * np.column_stack([samples.direction[:, j], samples.velocity[:, j], ones])
    values, vectors = np.linalg.eigh(expectation.floor)
    rows[:, :, -10:] = rows[:, :, :10] @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    rows = rows[samples.used] / np.sqrt(0.01 * motion.rate)
    H = rows.T @ rows + np.diag([0.0] * 10 + [1.0] * (size - 10))
    D = np.eye(size)
    D[:10, :10] = compute_jacobian(THETA)
    H = D.T @ H @ D
    H[:10, :10] += SolidPrior.for_hand().precision
    C = np.linalg.inv(H)[:10, :10]
    found = known.predict(motion)
    assert found.mass == pytest.approx(PAYLOAD[0] * np.sqrt(C[0, 0]), rel=1e-6)
    assert found.com == pytest.approx(np.sqrt(np.trace(C[1:4, 1:4])), rel=1e-6)


def test_deviations_of_central_moments_do_not_depend_on_the_centre(expectation, motion):
    far = replace(expectation, bodies=np.where(np.isin(np.arange(10), (1, 2, 3)), 0.5, THETA)[None])
    nothing = motion._replace(v=np.zeros_like(motion.v))
    # Nothing is seen: moments about the centre are as uncertain wherever that centre is.
    assert far.predict(nothing).inertia == pytest.approx(expectation.predict(nothing).inertia, rel=1e-6)


@pytest.mark.parametrize("fields", [("change_common_sd", "change_own_sd"), ("friction_sd",)])
def test_what_is_certain_is_not_counted(expectation, motion, fields):
    prior = replace(PRIORS[expectation.gains.kind], **dict.fromkeys(fields, 0.0))
    surer = replace(expectation, settings=replace(expectation.settings, signal_prior=prior))
    assert surer.predict(motion).mass < expectation.predict(motion).mass


def test_no_motion_averages_the_floor_out(expectation, motion):
    long_run = replace(expectation, error_density=np.full(6, 1e-8), floor=build_phantom_covariance(0.05))
    assert 0.04 < long_run.predict(motion).mass < 0.06
    assert replace(long_run, floor=np.zeros((10, 10))).predict(motion).mass < 0.02


def test_squares_are_averaged_over_bodies(expectation, motion):
    other = THETA + 0.3
    both = replace(expectation, bodies=np.array([THETA, other]))
    each = [replace(expectation, bodies=body[None]) for body in (THETA, other)]
    # The sign of load friction is that of the mean body; without load friction it counts for nothing.
    squares = [one.predict(motion).mass ** 2 for one in each]
    assert both.predict(motion).mass ** 2 == pytest.approx(np.mean(squares))


def test_rate_of_samples_hardly_counts(expectation, limits):
    family = FourierFamily(expectation.robot, limits, 8.0)
    numbers = family.draw(np.random.default_rng(2))
    coarse, fine = (expectation.predict(family.build(numbers, list_times(8.0, rate))) for rate in (10.0, 100.0))
    assert coarse.mass == pytest.approx(fine.mass, rel=0.05)
