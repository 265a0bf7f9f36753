"""Fit of a run: the most probable payload and the noise, each estimated given the other, to a fixed point."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.identification.evidence.evidence import ErrorModel, Evidence
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.joint_statistics import SIGNAL, JointStatistics
from affordance.identification.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.identification.posterior.body_posterior import Mode, guess_theta, improve_mode, measure_step
from affordance.identification.posterior.log_cholesky import parameters_from_theta
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.settings import IdentificationSettings

# Number of error variances over which a posterior is averaged.
_NUM_VARIANTS = 8
_MAX_ITERATIONS, _MAX_SIGN_PASSES = 40, 4
# Tolerances of a variance, as a fraction, and of a body, in squared standard deviations.
_VARIANCE_TOLERANCE, _TOLERANCE = 1e-2, 1e-3


class PayloadFit(NamedTuple):
    """Fit of a run."""

    evidence: Evidence  # evidence of the run, with the load signs of the fitted payload
    statistics: JointStatistics  # sums over the evidence
    likelihood: PayloadLikelihood  # likelihood of the ten parameters
    mode: Mode  # most probable body
    long_run_variance: Array  # long-run variance of each channel, shape (C,)
    weights: Array  # weights w with w^T z the residual, shape (C, 26)


def build_channel_prior(evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> ChannelPrior:
    """Builds the prior of all unknowns but the payload from gains that include drift."""
    friction_sd = evidence.list_friction_sds(settings)
    # Calibrated friction does not apply where a second run was subtracted.
    carried = None if evidence.is_difference or not settings.friction else gains.friction_sd
    return ChannelPrior(
        gains.mean,
        gains.covariance,
        np.zeros_like(friction_sd) if carried is None else gains.friction,
        friction_sd if carried is None else carried,
        evidence.phantom,
        evidence.phantom_covariance,
        not evidence.is_difference,
        *evidence.list_change_sds(gains.mean[:, 0], settings),
    )


def fit_payload(
    evidence: Evidence, prior: ChannelPrior, solid: SolidPrior, settings: IdentificationSettings
) -> PayloadFit:
    """Fits the most probable body, the noise, and the sign of the load that this body causes.

    If no joint moves fast enough for a sample to be used, a BadValueError is raised.
    """
    errors = evidence.describe_errors(settings)
    statistics = evidence.compute_statistics(settings)
    if not statistics.counts.any():
        problem = (
            f"never exceeds {settings.min_speed:g} rad/s at any joint, below which friction has no sure direction"
        )
        raise BadValueError(evidence.source, "v", f"{problem} (--min-speed 0 for torque sensors at rest)")
    likelihood, mode, variance, weights = fit_statistics(statistics, errors, prior, solid)
    for _ in range(_MAX_SIGN_PASSES):
        signs, evidence = evidence.samples.load_sign, evidence.with_load(mode.load)
        if np.array_equal(signs, evidence.samples.load_sign):
            break
        statistics = evidence.compute_statistics(settings)
        previous = variance
        likelihood, mode, variance, weights = fit_statistics(statistics, errors, prior, solid, mode.theta)
        if np.abs(variance / previous - 1.0).max() < _VARIANCE_TOLERANCE:
            break
    return PayloadFit(evidence, statistics, likelihood, mode, variance, weights)


def vary_errors(fit: PayloadFit, settings: IdentificationSettings) -> list[PayloadLikelihood]:
    """Builds likelihoods whose error variances are drawn from what the run leaves open of them.

    A variance that was estimated from n errors is n over a chi-squared variable of n degrees of freedom times its
    estimate. Each channel takes each of its quantiles once, in an order of its own (a Latin hypercube). Fewer than
    one error is taken as one, as quantiles would have no bound.
    """
    freedom = np.maximum(fit.evidence.describe_errors(settings).count_freedom(fit.statistics), 1.0)
    middles = (np.arange(_NUM_VARIANTS) + 0.5) / _NUM_VARIANTS
    rng = np.random.default_rng(0)
    quantiles = np.array([rng.permutation(chdtri(each, middles)) for each in freedom])
    factors = freedom[:, None] / quantiles
    return [
        PayloadLikelihood(fit.statistics, fit.likelihood.prior, fit.long_run_variance * each) for each in factors.T
    ]


def add_friction_error(
    evidence: Evidence, gains: Gains, solid: SolidPrior, settings: IdentificationSettings
) -> Evidence:
    """Returns a pair's evidence with errors of the model of friction, which do not average out, as a phantom payload.

    Its signs of the load are those of the payload that fits without these errors, as a start for the next fit.
    No model of friction is right. One standard deviation of a joint's error is all that its friction does: the change
    of the most probable load if the joint is taken to have none. Joints err independently. Errors of a fitted arm
    are measured, those of its friction included, and to an arm as its file has it no friction is no alternative; so
    nothing is added where no run was repeated. Nor is anything where gains are those of the arm's own weight: without
    friction they would be others, so that the change of the load is one of gains, and as large as the load.
    """
    if evidence.is_at_rest:  # friction has no direction there, and its errors are those of the residual
        return evidence
    if not (evidence.is_repeated and settings.floor and settings.friction) or gains.is_by_weight:
        return evidence
    prior = build_channel_prior(evidence, gains, settings)
    fit = fit_payload(evidence, prior, solid, settings)
    errors = evidence.describe_errors(settings)
    covariance = evidence.phantom_covariance
    for joint in range(len(prior.friction_sd)):
        friction_sd = prior.friction_sd.copy()
        friction_sd[joint] = 0.0
        without = replace(prior, friction_sd=friction_sd)
        _, mode, *_ = fit_statistics(fit.statistics, errors, without, solid, fit.mode.theta)
        change = mode.load - fit.mode.load
        covariance = covariance + np.outer(change, change)
    return replace(fit.evidence, phantom_covariance=covariance)


def fit_statistics(
    statistics: JointStatistics,
    errors: ErrorModel,
    prior: ChannelPrior,
    solid: SolidPrior,
    start: Array | None = None,
    max_iterations: int = _MAX_ITERATIONS,
) -> tuple[PayloadLikelihood, Mode, Array, Array]:
    """Fits the most probable body and the noise, each given the other, to a fixed point, from a theta or a guess.

    Returns: Likelihood, most probable body, long-run variance of each channel, and weights of the residual.
    """
    # At first a tenth of the signal is error, correlated by the filter alone.
    square = statistics.products[:, SIGNAL, SIGNAL] / np.maximum(statistics.counts, 1.0)
    least = np.maximum(errors.least_variance, np.finfo(float).tiny)
    likelihood = PayloadLikelihood(statistics, prior, np.maximum(0.01 * square * errors.alike, least))
    theta = guess_theta(likelihood, solid) if start is None else start
    load = parameters_from_theta(theta)
    variance = errors.estimate_variance(statistics, likelihood.build_residual_weights(load))
    for _ in range(max_iterations):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        mode = improve_mode(likelihood, solid, theta, load)
        step, theta, load = mode.theta - theta, mode.theta, mode.load
        weights = likelihood.build_residual_weights(load)
        previous, variance = variance, errors.estimate_variance(statistics, weights)
        settled = np.abs(variance / previous - 1.0).max() < _VARIANCE_TOLERANCE
        if settled and measure_step(step, mode) < _TOLERANCE:
            break
    return likelihood, mode, variance, weights
