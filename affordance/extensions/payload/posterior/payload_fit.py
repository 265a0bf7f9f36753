"""Fits the most probable payload and the noise variances of a run alternately."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.extensions.payload.evidence.evidence import ErrorModel, Evidence
from affordance.extensions.payload.evidence.gains import Gains
from affordance.extensions.payload.evidence.joint_statistics import (
    ARM,
    FRICTION,
    LOAD,
    NUM_COLUMNS,
    ROTOR,
    SIGNAL,
    JointStatistics,
)
from affordance.extensions.payload.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood, factor
from affordance.extensions.payload.posterior.body_posterior import Mode, guess_theta, improve_mode, measure_step
from affordance.extensions.payload.posterior.log_cholesky import compute_jacobian, parameters_from_theta
from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.settings import IdentificationSettings, SignalKind

# Number of error variances over which a posterior is averaged, and their cumulative probabilities.
_NUM_VARIANTS = 8
_MIDDLES = (np.arange(_NUM_VARIANTS) + 0.5) / _NUM_VARIANTS
_MAX_ITERATIONS, _MAX_SIGN_PASSES = 40, 4
# Tolerances: relative change of a variance, and change of the body in squared standard deviations.
_VARIANCE_TOLERANCE, _TOLERANCE = 1e-2, 1e-3
# Candidates for the variance of a wrist sensor's gains relative to the stated variance, evenly spaced in log.
_SPREADS = np.geomspace(0.0025, 2500.0, 400)
# Least increase of the log probability for using the second of two starts. Smaller differences are within the
# tolerance of one optimum.
_CLEARLY = 1.0
# Relative SD of a gain's change that makes its prior uninformative; finite-difference step for the derivatives of the
# estimate, in standard deviations of the load; and lower bound of n - 2.
_FREE, _STEP, _LEAST_FREEDOM = 10.0, 1e-4, 0.1


class PayloadFit(NamedTuple):
    """Fit of the most probable payload to a run."""

    evidence: Evidence  # evidence of the run, with the signs of load friction of the fitted payload
    statistics: JointStatistics  # sums over the evidence
    likelihood: PayloadLikelihood  # likelihood of the ten parameters
    mode: Mode  # most probable body
    long_run_variance: Array  # long-run variance of each channel, shape (C,)
    weights: Array  # weights w of the residual w^T z, shape (C, 27)


def build_channel_prior(evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> ChannelPrior:
    """Builds the prior of all unknowns except the payload, from gains that include drift."""
    friction_sd = evidence.list_friction_sds(settings)
    # Calibrated friction does not apply to the difference of two runs.
    carried = None if evidence.is_difference else gains.friction_sd
    return ChannelPrior(
        gains.mean,
        gains.covariance,
        np.zeros_like(friction_sd) if carried is None else gains.friction,
        friction_sd if carried is None else carried,
        evidence.phantom,
        evidence.phantom_covariance,
        not evidence.is_difference,
        *evidence.list_change_sds(gains.mean[:, 0], settings),
        evidence.list_rotor_sds(),
    )


def fit_payload(
    evidence: Evidence, prior: ChannelPrior, solid: SolidPrior, settings: IdentificationSettings
) -> PayloadFit:
    """Fits the most probable body, the signs of load friction, and the noise variances.

    The fit may stop at a false optimum where one channel's variance is as large as its signal and another channel's
    gain is many standard deviations from its prior. It therefore also starts from the load that the mean gains imply.
    The result of this second start is used if it is more probable even with the variances of the first.

    Raises:
        BadValueError: No joint moves fast enough for a sample to be used.
    """
    errors = evidence.build_error_model(settings)
    statistics = evidence.compute_statistics(settings)
    if not statistics.counts.any():
        problem = (
            f"never exceeds {settings.min_speed:g} rad/s at any joint, below which friction has no certain direction"
        )
        raise BadValueError(evidence.source, "v", f"{problem} (--min-speed 0 for torque sensors at rest)")
    likelihood, mode, variance, weights = fit_statistics(statistics, errors, prior, solid)
    exact = replace(prior, gain_covariance=np.zeros_like(prior.gain_covariance))
    start = fit_statistics(statistics, errors, exact, solid)[1].theta
    other = fit_statistics(statistics, errors, prior, solid, start)
    if _measure(likelihood, other[1], solid) > _measure(likelihood, mode, solid) + _CLEARLY:
        likelihood, mode, variance, weights = other
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


def _measure(likelihood: PayloadLikelihood, mode: Mode, solid: SolidPrior) -> float:
    """Computes the log probability of a body and its phantom payload, up to a constant."""
    phantom = mode.load - mode.pi
    of_phantom = phantom @ np.linalg.pinv(likelihood.prior.phantom_covariance) @ phantom
    of_body = solid.compute_log_density(mode.theta[None])[0]
    return float(likelihood.compute_log_likelihood(mode.load[None])[0] + of_body - 0.5 * of_phantom)


def measure_axes(fit: PayloadFit) -> tuple[Array, Array]:
    """Estimates a wrist sensor's force scale along each axis, relative to the fitted load.

    The scale is the slope of a regression of measured on predicted force, with an offset and without the prior of the
    gains.

    Returns: The scales and their standard errors, shape (3,) each.
    """
    samples = fit.evidence.samples
    expected = (samples.Y @ (fit.mode.load + fit.likelihood.prior.phantom))[:, :3]
    about = expected - expected.mean(axis=0)
    squares = np.maximum((about**2).sum(axis=0), np.finfo(float).tiny)
    return (about * samples.signal[:, :3]).sum(axis=0) / squares, np.sqrt(fit.long_run_variance[:3] / squares)


def spread_gains(fit: PayloadFit) -> Array:
    """Infers the variance of a wrist sensor's gains from differences between its axes.

    The variance of a gain about the common factor has a scaled inverse chi-squared prior, in which the stated
    variance counts as one gain. Force scales are normal about their mean, with this variance plus their error
    variance. Three axes give an uncertain variance, so the posterior of the load is averaged over it.

    Args:
        fit: Fit with the stated gains.

    Returns: Equally probable quantiles of the variance relative to the stated variance, shape (_NUM_VARIANTS,); ones
        without a wrist sensor.
    """
    if fit.evidence.kind is not SignalKind.WRENCH:
        return np.ones(_NUM_VARIANTS)
    scale, error = measure_axes(fit)
    of_each = _SPREADS[:, None] * fit.likelihood.prior.gain_covariance[:3, 0, 0].mean() + error**2
    mean = (scale / of_each).sum(axis=1) / (1.0 / of_each).sum(axis=1)
    log_density = np.log(of_each).sum(axis=1) + ((scale - mean[:, None]) ** 2 / of_each).sum(axis=1)
    log_density += np.log((1.0 / of_each).sum(axis=1)) + np.log(_SPREADS) + 1.0 / _SPREADS
    below = np.cumsum(np.exp(-0.5 * (log_density - log_density.min())))
    quantiles: Array = np.exp(np.interp(_MIDDLES, below / below[-1], np.log(_SPREADS)))
    return quantiles


def vary_unknowns(fit: PayloadFit, spreads: Array, settings: IdentificationSettings) -> list[PayloadLikelihood]:
    """Builds likelihoods with error and gain variances drawn from their posterior.

    A variance estimated from n errors is its estimate times n over a chi-squared variable with n degrees of freedom.
    Each channel has each quantile once, in its own random order (a Latin hypercube). n is at least one, because
    quantiles would otherwise be unbounded. Errors of postures are not varied here, because they are widened with
    Student's t elsewhere.

    Args:
        fit: Fit of the run.
        spreads: Factors of the gain covariances, one per likelihood, shape (_NUM_VARIANTS,).
        settings: Settings of the identification.
    """
    freedom = np.maximum(fit.evidence.build_error_model(settings).count_freedom(fit.statistics, fit.weights), 1.0)
    rng, prior = np.random.default_rng(0), fit.likelihood.prior
    quantiles = np.array([rng.permutation(chdtri(each, _MIDDLES)) for each in freedom])
    factors = np.ones_like(quantiles) if fit.evidence.is_at_rest else freedom[:, None] / quantiles
    return [
        PayloadLikelihood(
            fit.statistics,
            replace(prior, gain_covariance=spread * prior.gain_covariance),
            fit.long_run_variance * factor,
        )
        for spread, factor in zip(rng.permutation(spreads), factors.T, strict=True)
    ]


def estimate_changes(fit: PayloadFit, solid: SolidPrior, settings: IdentificationSettings) -> tuple[Array, Array]:
    """Estimates each gain's change since the subtracted run, without a prior on the change.

    Body and variances are fitted again together with the changes. The errors of the changes include the uncertainty
    of body and phantom payload. A variance estimated from n errors is multiplied by n / (n - 2), as for Student's t,
    unless earlier runs give a lower bound.

    Returns: The relative changes, shape (C,), and the covariance, (C, C), expected from errors and usual changes.
    """
    prior, statistics = fit.likelihood.prior, fit.statistics
    num, gain = statistics.num_channels, np.where(prior.gain[:, 0] == 0.0, np.inf, prior.gain[:, 0])
    free = replace(prior, own_change_sd=_FREE * np.abs(prior.gain[:, 0]), shared_change_sd=0.0)
    errors = fit.evidence.build_error_model(settings)
    likelihood, mode, variance, weights = fit_statistics(statistics, errors, free, solid, fit.mode.theta)
    change = -weights[:, ARM] / gain
    freedom = errors.count_freedom(statistics, weights)
    widening = freedom / np.maximum(freedom - 2.0, _LEAST_FREEDOM)
    variance = variance * np.where(errors.least_variance > 0.0, 1.0, widening)
    # Regressor columns of g, h, friction, rotor inertia and change at the most probable load.
    columns, half = np.zeros((NUM_COLUMNS, 7)), LOAD.stop // 2
    columns[1:half, 0] = columns[half + 1 : LOAD.stop, 1] = mode.load + prior.phantom
    columns[[*range(FRICTION.start, FRICTION.stop), ROTOR, ARM], range(2, 7)] = 1.0
    root = np.zeros((num, 7, 7))
    root[:, :2, :2] = factor(prior.gain_covariance)
    rotor_sd = np.broadcast_to(prior.rotor_sd, num)
    root[:, range(2, 7), range(2, 7)] = np.column_stack([prior.friction_sd, rotor_sd, free.own_change_sd])
    precision = columns.T @ statistics.products @ columns / variance[:, None, None]
    inner = np.linalg.inv(np.eye(7) + root.transpose(0, 2, 1) @ precision @ root)
    of_data = (root @ inner @ root.transpose(0, 2, 1))[:, 6, 6]
    D = compute_jacobian(mode.theta)
    before = factor(D @ solid.covariance @ D.T + prior.phantom_covariance)
    seen = before.T @ PayloadLikelihood(statistics, free, variance).linearise(mode.load).precision @ before
    steps = _STEP * factor(before @ np.linalg.inv(np.eye(len(seen)) + seen) @ before.T)
    displaced = np.array([-likelihood.build_residual_weights(mode.load + step)[:, ARM] for step in steps.T])
    of_load = (displaced / gain - change) / _STEP
    shared, own = (np.broadcast_to(each, num) / gain for each in (prior.shared_change_sd, prior.own_change_sd))
    return change, np.diag(of_data / gain**2 + own**2) + np.outer(shared, shared) + of_load.T @ of_load


def add_friction_error(
    evidence: Evidence, gains: Gains, solid: SolidPrior, settings: IdentificationSettings
) -> Evidence:
    """Adds errors of the friction model, as a phantom payload, to the evidence of a pair of runs.

    No friction model is exact. One standard deviation of a joint's error is assumed to be the whole effect of its
    friction: the change of the most probable load if the joint has no friction. Errors of joints are independent and
    do not average out.

    Errors are added only for a repeated motion. The measured errors of a fitted arm already include friction, and an
    arm modelled from its file is invalid without friction. Errors are not added if the gains come from the arm's own
    weight, because without friction these gains, and thus the load, would change by as much as the load itself.

    Returns: Evidence with these errors, and with the signs of load friction of the payload fitted without them, as a
        start for the next fit.
    """
    if evidence.is_at_rest:  # friction has no direction at rest, and is part of the residual
        return evidence
    if not (evidence.is_repeated and settings.floor) or gains.is_by_weight:
        return evidence
    prior = build_channel_prior(evidence, gains, settings)
    fit = fit_payload(evidence, prior, solid, settings)
    errors = evidence.build_error_model(settings)
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
) -> tuple[PayloadLikelihood, Mode, Array, Array]:
    """Fits the most probable body and the noise variances alternately until both are stable.

    Args:
        statistics: Sums of products of the run.
        errors: Error model.
        prior: Prior of all unknowns except the payload.
        solid: Prior of the body.
        start: Theta at which the iteration starts; None to guess it.

    Returns: Likelihood, most probable body, long-run variance of each channel, and weights of the residual.
    """
    # Initially the error is a tenth of the signal, correlated by the filter alone.
    square = statistics.products[:, SIGNAL, SIGNAL] / np.maximum(statistics.counts, 1.0)
    least = np.maximum(errors.least_variance, np.finfo(float).tiny)
    likelihood = PayloadLikelihood(statistics, prior, np.maximum(0.01 * square * errors.alike, least))
    theta = guess_theta(likelihood, solid) if start is None else start
    load = parameters_from_theta(theta)
    variance = errors.estimate_variance(statistics, likelihood.build_residual_weights(load))
    for _ in range(_MAX_ITERATIONS):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        mode = improve_mode(likelihood, solid, theta, load)
        step, theta, load = mode.theta - theta, mode.theta, mode.load
        weights = likelihood.build_residual_weights(load)
        previous, variance = variance, errors.estimate_variance(statistics, weights)
        settled = np.abs(variance / previous - 1.0).max() < _VARIANCE_TOLERANCE
        if settled and measure_step(step, mode) < _TOLERANCE:
            break
    return likelihood, mode, variance, weights
