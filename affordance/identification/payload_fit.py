"""The most probable payload of a run, together with how noisy the run is: each decides the other, to a fixed point."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.exceptions import BadValueError
from affordance.identification.body_posterior import Mode, find_mode
from affordance.identification.evidence import ErrorModel, Evidence
from affordance.identification.gains import Gains
from affordance.identification.joint_statistics import SIGNAL, JointStatistics
from affordance.identification.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.identification.solid_prior import SolidPrior

_MAX_ITERATIONS, _MAX_SIGN_PASSES = 12, 4
_TOLERANCE = 1e-3  # of a variance, as a fraction
# Numbers a run is fitted with, that its residual lacks: ten, shared by the channels, and friction of each.
_SHARED, _OWN = 10.0, 3.0
# Fewer independent samples than this say little about their own variance.
_FEWEST = 2.0
# Of a wrist sensor, offsets of moments over those of forces, by the arms its forces have, [m].
MOMENT_SHARE = 0.1


class PayloadFit(NamedTuple):
    """A fitted run.

    Attributes:
        evidence: Its samples, the sign of the load as the payload makes it.
        statistics: Their sums.
        likelihood: Of the ten parameters.
        mode: The most probable body.
        long_run_variance: Of each channel, shape (C,).
        weights: w with w^T z the residual, shape (C, 26).
    """

    evidence: Evidence
    statistics: JointStatistics
    likelihood: PayloadLikelihood
    mode: Mode
    long_run_variance: Array
    weights: Array


def build_channel_prior(evidence: Evidence, gains: Gains, settings: IdentificationSettings) -> ChannelPrior:
    """What is known before a run of all but the payload, gains drifted since they were found."""
    return ChannelPrior(
        gains.mean,
        gains.covariance,
        list_friction_sds(evidence, settings),
        evidence.phantom,
        evidence.phantom_covariance,
    )


def list_friction_sds(evidence: Evidence, settings: IdentificationSettings) -> Array:
    """Standard deviations of Coulomb and viscous friction and offset, shape (C, 3); a wrist sensor has offsets alone."""
    sd = evidence.friction_scale * settings.get_prior(evidence.kind).friction_sd
    if evidence.kind is not SignalKind.WRENCH:
        return np.full((len(evidence.channel_names), 3), sd)
    return np.outer(np.where(np.arange(6) < 3, 1.0, MOMENT_SHARE), [0.0, 0.0, sd])


def fit_payload(
    evidence: Evidence, prior: ChannelPrior, solid: SolidPrior, settings: IdentificationSettings
) -> PayloadFit:
    """Fits the most probable body and the noise, and the sign of the load as that body makes it.

    Args:
        evidence: The run.
        prior: Of gains, friction and the arm's model.
        solid: Of the body.
        settings: Of the noise.

    Raises:
        BadValueError: No sample counts.
    """
    errors = evidence.describe_errors(settings)
    statistics = evidence.compute_statistics(settings)
    if not statistics.counts.any():
        problem = (
            f"never exceeds {settings.min_speed:g} rad/s at any joint, below which friction has no sure direction"
        )
        raise BadValueError(evidence.source, "v", f"{problem} (--min-speed 0 for torque sensors at rest)")
    fit, theta = None, None
    for _ in range(_MAX_SIGN_PASSES):
        previous, fit = fit, fit_statistics(statistics, errors, prior, solid, theta)
        theta = fit.mode.theta
        if previous is not None and np.abs(fit.variance / previous.variance - 1.0).max() < _TOLERANCE:
            break
        evidence = evidence.with_load(fit.mode.pi)
        statistics = evidence.compute_statistics(settings)
    return PayloadFit(evidence, statistics, fit.likelihood, fit.mode, fit.variance, fit.weights)


class StatisticsFit(NamedTuple):
    """What sums over samples alone say.

    Attributes:
        likelihood: Of the ten parameters.
        mode: The most probable body.
        variance: Long-run variance of each channel, shape (C,).
        weights: w with w^T z the residual, shape (C, 26).
    """

    likelihood: PayloadLikelihood
    mode: Mode
    variance: Array
    weights: Array


def fit_statistics(
    statistics: JointStatistics,
    errors: ErrorModel,
    prior: ChannelPrior,
    solid: SolidPrior,
    start: Array | None = None,
    max_iterations: int = _MAX_ITERATIONS,
) -> StatisticsFit:
    """Fits the most probable body and the noise, each of which decides the other, to a fixed point.

    Args:
        statistics: Sums over the samples.
        errors: What is known of the noise beforehand.
        prior: Of gains, friction and the arm's model.
        solid: Of the body.
        start: Theta to start from, shape (10,); None for a guess.
        max_iterations: Rounds of body and noise.
    """
    variance = _start_variance(statistics, errors)
    for _ in range(max_iterations):
        likelihood = PayloadLikelihood(statistics, prior, variance)
        mode = find_mode(likelihood, solid, start)
        start = mode.theta
        weights = likelihood.build_residual_weights(mode.pi)
        previous, variance = variance, estimate_variance(statistics, weights, errors)
        if np.abs(variance / previous - 1.0).max() < _TOLERANCE:
            break
    return StatisticsFit(likelihood, mode, variance, weights)


def estimate_variance(statistics: JointStatistics, weights: Array, errors: ErrorModel) -> Array:
    """Estimates the long-run variance of each channel's error from a residual, shape (C,).

    Squared sums of the residual over blocks, over the number of samples: the variance of one times the number of
    samples that share it. No less than if only what the filter joined were alike, and than earlier runs say.
    """
    count = np.maximum(statistics.counts, 1.0)
    single = np.maximum(statistics.sum_squares(weights) / count, np.finfo(float).tiny)
    variance = single * errors.alike
    if errors.correlated:
        variance = np.maximum(variance, statistics.sum_block_squares(weights) / count)
    independent = count * single / variance
    fitted = _OWN + _SHARED / statistics.num_channels
    variance = variance * independent / np.maximum(independent - fitted, np.minimum(independent, _FEWEST))
    return np.where(statistics.counts > 0, np.maximum(variance, errors.least_variance), 1.0)


def _start_variance(statistics: JointStatistics, errors: ErrorModel) -> Array:
    """As if a tenth of the signal were error, alike over what the filter joined."""
    signal = statistics.products[:, SIGNAL, SIGNAL] / np.maximum(statistics.counts, 1.0)
    return np.maximum(0.01 * signal * errors.alike, np.maximum(errors.least_variance, np.finfo(float).tiny))
