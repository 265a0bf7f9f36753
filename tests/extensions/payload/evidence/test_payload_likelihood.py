"""The closed form against the density of all samples at once, as a multivariate normal distribution."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import logsumexp
from scipy.stats import chi2, f, multivariate_normal

from affordance.arrays import Array
from affordance.belief.likelihood import Quadratic
from affordance.extensions.payload.evidence.joint_statistics import ChannelSamples, compute_statistics
from affordance.extensions.payload.evidence.payload_likelihood import BodyLikelihood, ChannelPrior, PayloadLikelihood

_CHANNELS = 3


def _build_prior(rng: np.random.Generator, *, gain_sd: float, phantom_sd: float) -> ChannelPrior:
    root, phantom = gain_sd * rng.standard_normal((_CHANNELS, 2, 2)), phantom_sd * rng.standard_normal((10, 10))
    return ChannelPrior(
        rng.standard_normal((_CHANNELS, 2)),
        root @ root.transpose(0, 2, 1),
        rng.standard_normal((_CHANNELS, 3)),
        np.abs(rng.standard_normal((_CHANNELS, 3))),
        0.1 * rng.standard_normal(10),
        phantom @ phantom.T,
        rotor_sd=np.abs(rng.standard_normal(_CHANNELS)),
    )


_KNOWN_GAINS = ChannelPrior(np.tile([1.0, 0.0], (3, 1)), np.zeros((3, 2, 2)), np.zeros((3, 3)), np.zeros((3, 3)))


def _build_samples(Y: Array, signal: Array) -> ChannelSamples:
    """Samples without friction and without an arm."""
    zero = np.zeros_like(signal)
    return ChannelSamples(Y, zero, zero, zero, zero, zero, signal, np.ones(signal.shape, dtype=bool))


def _compute_density(samples: ChannelSamples, prior: ChannelPrior, variance: Array, pi: Array) -> float:
    """Log density of all samples, the phantom's spread included (through gains as they are on average)."""
    used = samples.used
    blocks, means, values, T, shared = [], [], [], [], []
    for c in range(_CHANNELS):
        k = used[:, c]
        arm = samples.tau_arm[k, c]
        load, s = prior.has_arm * arm + samples.Y[k, c] @ (pi + prior.phantom), samples.load_sign[k, c]
        A = np.column_stack([load, s * load])
        F = np.column_stack([samples.direction[k, c], samples.velocity[k, c], np.ones(k.sum())])
        blocks.append(
            variance[c] * np.eye(k.sum())
            + A @ prior.gain_covariance[c] @ A.T
            + F @ np.diag(prior.friction_sd[c] ** 2) @ F.T
            + np.broadcast_to(prior.rotor_sd, _CHANNELS)[c] ** 2 * np.outer(*[samples.acceleration[k, c]] * 2)
            + np.broadcast_to(prior.own_change_sd, _CHANNELS)[c] ** 2 * np.outer(arm, arm)
        )
        shared.append(np.broadcast_to(prior.shared_change_sd, _CHANNELS)[c] * arm)
        means.append(A @ prior.gain[c] + F @ prior.friction[c])
        values.append(samples.signal[k, c])
        T.append((prior.gain[c, 0] + prior.gain[c, 1] * s)[:, None] * samples.Y[k, c])
    size = sum(len(block) for block in blocks)
    V, place = np.zeros((size, size)), 0
    for block in blocks:
        V[place : place + len(block), place : place + len(block)] = block
        place += len(block)
    stacked = np.vstack(T)
    V += stacked @ prior.phantom_covariance @ stacked.T + np.outer(*[np.concatenate(shared)] * 2)
    return float(multivariate_normal.logpdf(np.concatenate(values), np.concatenate(means), V))


def test_nuisances_are_integrated_out_exactly(samples, rng):
    variance = np.array([0.5, 1.0, 2.0])
    prior = _build_prior(rng, gain_sd=0.5, phantom_sd=0.0)
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
    bodies = rng.standard_normal((6, 10))
    brute = [_compute_density(samples, prior, variance, pi) for pi in bodies]
    difference = likelihood.compute_log_likelihood(bodies) - brute
    assert_allclose(difference, difference[0], atol=1e-8)


def test_a_change_of_gains_since_the_subtracted_run_is_integrated_out_exactly(samples, rng):
    """The arm's torque is a term of every channel, and one of all together; its load columns count for nothing."""
    variance = np.array([0.5, 1.0, 2.0])
    exact = _build_prior(rng, gain_sd=0.5, phantom_sd=0.0)
    prior = replace(
        exact, has_arm=False, shared_change_sd=np.array([0.3, -0.2, 0.5]), own_change_sd=np.array([0.1, 0.4, 0.2])
    )
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
    bodies = rng.standard_normal((6, 10))
    difference = likelihood.compute_log_likelihood(bodies) - [
        _compute_density(samples, prior, variance, pi) for pi in bodies
    ]
    assert_allclose(difference, difference[0], atol=1e-8)
    # With known gains it is its quadratic, also where the shared change is an unknown of it.
    known = replace(prior, gain_covariance=np.zeros((_CHANNELS, 2, 2)))
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), known, variance)
    difference = likelihood.compute_log_likelihood(bodies) - likelihood.linearise(bodies[0]).evaluate(bodies)
    assert_allclose(difference, difference[0], atol=1e-8)


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_log_evidence_compares_priors_of_friction(samples, rng, size):
    """It differs from the density of all samples by one number for all priors of friction, with a normal load."""
    variance, covariance = np.array([0.5, 1.0, 2.0]), 0.3 * np.eye(10)
    apart = []
    for friction in (0.1, 1.0, 3.0):
        prior = replace(_KNOWN_GAINS, friction_sd=np.full((3, 3), friction), phantom_covariance=size**2 * covariance)
        likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
        ours = likelihood.compute_log_evidence(covariance, np.array([size]))[0]
        apart.append(ours - _compute_density(samples, prior, variance, np.zeros(10)))
    assert_allclose(apart, apart[0], atol=1e-8)


def test_with_known_gains_the_likelihood_is_its_quadratic(samples, rng):
    prior = _build_prior(rng, gain_sd=0.0, phantom_sd=0.0)
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, np.ones(_CHANNELS))
    bodies = rng.standard_normal((6, 10))
    difference = likelihood.compute_log_likelihood(bodies) - likelihood.linearise(bodies[0]).evaluate(bodies)
    assert_allclose(difference, difference[0], atol=1e-9)


def test_the_quadratic_touches_the_likelihood_at_its_top(samples, rng):
    prior = _build_prior(rng, gain_sd=0.1, phantom_sd=0.0)
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, np.full(_CHANNELS, 0.01))
    pi = np.zeros(10)
    for _ in range(30):
        quadratic = likelihood.linearise(pi)
        pi = np.linalg.solve(quadratic.precision, quadratic.information)
    steps = 1e-4 * np.eye(10)
    slope = (likelihood.compute_log_likelihood(pi + steps) - likelihood.compute_log_likelihood(pi - steps)) / 2e-4
    # The slope that is left comes from the determinant, which the quadratic leaves out; in standard deviations.
    sd = np.sqrt(np.diag(np.linalg.inv(quadratic.precision)))
    assert np.abs(slope * sd).max() < 0.3


def test_a_phantom_is_integrated_out_exactly_where_gains_are_known(samples, rng):
    variance = np.array([0.5, 1.0, 2.0])
    prior = _build_prior(rng, gain_sd=0.0, phantom_sd=0.3)
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
    bodies = rng.standard_normal((5, 10))
    ours = BodyLikelihood(likelihood, bodies[0]).compute(bodies, rng.standard_normal(bodies.shape))
    difference = ours - [_compute_density(samples, prior, variance, pi) for pi in bodies]
    assert_allclose(difference, difference[0], atol=1e-8)


def test_widening_is_adding_a_normal_error(rng):
    root = rng.standard_normal((10, 10))
    prior = _build_prior(rng, gain_sd=0.0, phantom_sd=1.0)
    H = root @ root.T
    b = rng.standard_normal(10)
    wide = Quadratic(H, b).widen(prior.phantom_covariance)
    assert_allclose(np.linalg.inv(wide.precision), np.linalg.inv(H) + prior.phantom_covariance, rtol=1e-6)
    assert_allclose(np.linalg.solve(wide.precision, wide.information), np.linalg.solve(H, b), rtol=1e-6)


def test_the_residual_is_what_the_best_friction_leaves(samples, rng):
    prior = _build_prior(rng, gain_sd=0.0, phantom_sd=0.0)
    variance = np.array([0.5, 1.0, 2.0])
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
    pi = rng.standard_normal(10)
    w = likelihood.build_residual_weights(pi)
    c, k = 1, samples.used[:, 1]
    F = np.column_stack(
        [samples.direction[k, c], samples.velocity[k, c], np.ones(k.sum()), samples.acceleration[k, c]]
    )
    load = samples.tau_arm[k, c] + samples.Y[k, c] @ (pi + prior.phantom)
    rest = samples.signal[k, c] - (prior.gain[c, 0] + prior.gain[c, 1] * samples.load_sign[k, c]) * load
    precision = F.T @ F / variance[c] + np.diag(np.append(prior.friction_sd[c], prior.rotor_sd[c]) ** -2.0)
    information = F.T @ rest / variance[c] + np.append(prior.friction[c] / prior.friction_sd[c] ** 2, 0.0)
    assert_allclose(-w[c, 22:26], np.linalg.solve(precision, information), rtol=1e-9)


def test_a_phantom_is_integrated_out_on_average_where_gains_are_uncertain(samples, rng):
    """The log ratio of two bodies' likelihoods agrees to 0.03 with means over phantoms drawn from their prior."""
    prior, variance = _build_prior(rng, gain_sd=0.3, phantom_sd=0.05), np.array([20.0, 40.0, 60.0])
    likelihood = PayloadLikelihood(compute_statistics(samples, 5), prior, variance)
    bodies = 0.3 * rng.standard_normal((2, 10))
    of_body = BodyLikelihood(likelihood, bodies[0])
    phantoms = rng.multivariate_normal(np.zeros(10), prior.phantom_covariance, 40_000)
    ours, brute = [], []
    for pi in bodies:
        ours.append(
            logsumexp(of_body.compute(np.tile(pi, (2000, 1)), of_body.draw_normals(rng, 2000))) - np.log(2000)
        )
        brute.append(logsumexp(likelihood.compute_log_likelihood(pi + phantoms)) - np.log(40_000))
    assert ours[1] - ours[0] == pytest.approx(brute[1] - brute[0], abs=0.03)


def test_loads_that_are_far_too_heavy_are_never_more_probable():
    """Loads 1e4 to 1e14 times too heavy are never more probable, though gains near zero explain all but rounding."""
    rng = np.random.default_rng(7)
    Y, pi = 5.0 * rng.standard_normal((4, 3, 10)), rng.standard_normal(10)
    prior = replace(_KNOWN_GAINS, gain_covariance=np.tile(1e-4 * np.eye(2), (3, 1, 1)))
    samples = _build_samples(Y, Y @ pi + 0.02 * rng.standard_normal((4, 3)))
    likelihood = PayloadLikelihood(compute_statistics(samples, 1), prior, np.full(3, 5e-4))
    scales = np.logspace(4.0, 14.0, 101)
    found = likelihood.compute_log_likelihood(np.vstack([pi, scales[:, None] * pi]))
    assert (found[1:] < found[0]).all()


def test_distances_are_f_distributed_with_the_errors_that_a_variance_was_estimated_from():
    """Distances follow F where one channel, with a variance from six errors, has nearly all information."""
    rng = np.random.default_rng(4)
    Y = rng.standard_normal((60, 3, 10)) * [[[1.0], [0.02], [0.02]]]
    surprises = []
    for _ in range(600):
        statistics = compute_statistics(_build_samples(Y, rng.standard_normal((60, 3))), 10)
        likelihood = PayloadLikelihood(statistics, _KNOWN_GAINS, rng.chisquare(6, 3) / 6.0)
        quadratic = likelihood.linearise(np.zeros(10))
        distance = quadratic.information @ np.linalg.solve(quadratic.precision, quadratic.information)
        dof = likelihood.count_errors(np.zeros(10), np.zeros((10, 10)))
        surprises.append((f.sf(distance / 10.0, 10, dof), chi2.sf(distance, 10)))
    shares = (np.array(surprises) < 0.05).mean(axis=0)
    assert 0.03 < shares[0] < 0.075  # 0.05 with a standard error of 0.009
    assert shares[1] > 2.0 * shares[0]  # variances taken for known
    assert likelihood.count_errors(np.zeros(10), 1e3 * np.eye(10)) > 1e4  # errors of known size rule
