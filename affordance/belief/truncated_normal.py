"""Multivariate normal distribution restricted to positive values, x ~ N(mean, covariance) given x > 0.

Arguments are the mean, (M,), and the covariance, (M, M), of the unrestricted distribution. Uncorrelated coordinates
are treated separately, and a single coordinate has closed forms. Two or three correlated coordinates are integrated
by nested quadrature. Four or more are averaged over weighted points, which is less accurate.
"""

from collections.abc import Iterator

import numpy as np
import scipy  # imports its submodules on first use; some take a tenth of a second to a second
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri

from affordance.arrays import Array
from affordance.belief import orthant_quadrature
from affordance.belief.minimax_tilting import build_proposal, compute_excess, compute_mean_excess, propose
from affordance.exceptions import AffordanceError

# Correlation below which two coordinates count as uncorrelated, because of rounding errors.
_UNRELATED = 1e-12
# Largest number of coordinates for quadrature; four would take seconds.
_MAX_NESTED = 3
# Binary logarithm of the number of weighted points for four or more coordinates.
_LOG2_POINTS = 14
_ROOT_TOLERANCE = 1e-9
# Smallest size of a batch of proposals, and largest number of batches.
_SMALLEST_BATCH = 64
_MAX_BATCHES = 1000


def compute_log_mass(mean: Array, covariance: Array) -> float:
    """Computes log P(x > 0) of the unrestricted distribution.

    The error is at most 1e-8 or the rounding error of a large logarithm. With four or more correlated coordinates, it
    is about 1e-5.
    """
    log_mass = 0.0
    for block, block_mean, block_covariance in _split(mean, covariance):
        if len(block) <= _MAX_NESTED:
            log_mass += orthant_quadrature.compute_log_mass(block_mean, block_covariance)
        else:
            _, weights, log_bound = _weigh_points(block_mean, block_covariance)
            log_mass += log_bound + float(np.log(weights.mean()))
    return log_mass


def compute_percentiles(mean: Array, covariance: Array, fractions: Array) -> Array:
    """Computes percentiles of each coordinate's marginal, (P, M), for P fractions in (0, 1).

    The error is 1e-6 of the marginal's SD, and up to 5e-6 for correlations near one. With four or more correlated
    coordinates, it is at most a few 1e-4 of the SD between the quartiles, and up to 3e-3 below the first and above
    the 99th percentile.
    """
    percentiles = np.empty((len(fractions), len(mean)))
    for block, block_mean, block_covariance in _split(mean, covariance):
        if len(block) == 1:
            sd = np.sqrt(block_covariance[0])
            percentiles[:, block] = sd * compute_excess(block_mean / sd, np.log1p(-fractions))[:, None]
        elif len(block) <= _MAX_NESTED:
            for i, coordinate in enumerate(block):
                table = orthant_quadrature.tabulate_marginal(block_mean, block_covariance, i)
                percentiles[:, coordinate] = _interpolate_percentiles(*table, fractions)
        else:
            t, sds, weights = _condition_points(block_mean, block_covariance)
            for i, coordinate in enumerate(block):
                percentiles[:, coordinate] = sds[i] * _average_percentiles(t[:, i], weights, fractions)
    return percentiles


def compute_mean(mean: Array, covariance: Array) -> Array:
    """Computes the mean of each coordinate, (M,), with the accuracy of the percentiles."""
    result = np.empty_like(mean)
    for block, block_mean, block_covariance in _split(mean, covariance):
        if len(block) == 1:
            sd = np.sqrt(block_covariance[0])
            result[block] = sd * compute_mean_excess(block_mean / sd)
        elif len(block) <= _MAX_NESTED:
            for i, coordinate in enumerate(block):
                nodes, shares = orthant_quadrature.tabulate_marginal(block_mean, block_covariance, i)
                result[coordinate] = np.average(nodes, weights=shares)
        else:
            t, sds, weights = _condition_points(block_mean, block_covariance)
            result[block] = sds * np.average(compute_mean_excess(t), axis=0, weights=weights)
    return result


def draw_samples(
    mean: Array, covariance: Array, rng: np.random.Generator, num_samples: int, *, is_even: bool = False
) -> Array:
    """Draws exact samples, (num_samples, M), by rejection sampling.

    More than a quarter of all proposals is accepted for two or three coordinates, and at least about one in a hundred
    for ten coordinates.

    Args:
        mean: Mean of the unrestricted distribution, (M,).
        covariance: Covariance of the unrestricted distribution, (M, M).
        rng: Random number generator.
        num_samples: Number of samples.
        is_even: If True, samples are spread evenly, in random order, which makes averages more accurate. Otherwise
            they are independent.

    Raises:
        AffordanceError: Too few proposals were accepted.
    """
    samples = np.empty((num_samples, len(mean)))
    batch = max(num_samples, _SMALLEST_BATCH)
    even = _spread(len(mean), batch, rng) if is_even else np.empty((0, len(mean)))
    for block, block_mean, block_covariance in _split(mean, covariance):
        proposal = build_proposal(block_mean, block_covariance)
        accepted = np.empty((0, len(block)))
        for number in range(_MAX_BATCHES):
            # Uniform numbers are in (0, 1], and are drawn for one coordinate after the other.
            uniforms = even[:, block] if is_even and not number else rng.random((len(block), batch)).T
            points, log_weights = propose(proposal, 1.0 - uniforms)
            accepted = np.concatenate([accepted, points[rng.random(batch) < np.exp(log_weights)]])
            if len(accepted) >= num_samples:
                break
        else:
            raise AffordanceError(
                f"of {_MAX_BATCHES * batch} proposals for {len(block)} coordinates {len(accepted)} were accepted, "
                f"{num_samples} were wanted"
            )
        samples[:, block] = accepted[:num_samples]
    return samples


def _split(mean: Array, covariance: Array) -> Iterator[tuple[NDArray[np.intp], Array, Array]]:
    """Splits coordinates into mutually uncorrelated sets. Yields indices, mean and covariance of each set."""
    sds = np.sqrt(np.diag(covariance))
    related = np.abs(covariance) > _UNRELATED * np.outer(sds, sds)
    reachable = np.linalg.matrix_power(related, len(related))
    for first in np.flatnonzero(~np.tril(reachable, -1).any(axis=1)):
        block = np.flatnonzero(reachable[first])
        yield block, mean[block], covariance[np.ix_(block, block)]


def _spread(num_coordinates: int, num_points: int, rng: np.random.Generator) -> Array:
    """Draws evenly spread points in the unit cube, in random order, (num_points, num_coordinates)."""
    sequence = scipy.stats.qmc.Sobol(num_coordinates, rng=rng).random_base2((num_points - 1).bit_length())
    points: Array = rng.permutation(sequence[:num_points])
    return points


def _weigh_points(mean: Array, covariance: Array) -> tuple[Array, Array, float]:
    """Draws evenly spread proposals with weights.

    Returns:
        Points, (N, M), weights relative to the largest possible weight, (N,), and log of the largest possible weight.
    """
    proposal = build_proposal(mean, covariance)
    # The seed is fixed, so that equal arguments give equal results.
    uniforms = 1.0 - scipy.stats.qmc.Sobol(len(mean), rng=np.random.default_rng(0)).random_base2(_LOG2_POINTS)
    points, log_weights = propose(proposal, uniforms)
    return points, np.exp(log_weights), proposal.log_bound


def _condition_points(mean: Array, covariance: Array) -> tuple[Array, Array, Array]:
    """Computes the distribution of each coordinate given the other coordinates of a weighted point.

    These distributions are truncated normals. Their average over points is a smooth estimate of the marginals.

    Returns:
        Means divided by SDs, (N, M), SDs, (M,), and weights of the points, (N,).
    """
    points, weights, _ = _weigh_points(mean, covariance)
    precision = np.linalg.inv(covariance)
    sds = 1.0 / np.sqrt(np.diag(precision))
    return points / sds - (points - mean) @ precision * sds, sds, weights


def _average_percentiles(t: Array, weights: Array, fractions: Array) -> Array:
    """Computes percentiles of a mixture of normal distributions N(t, 1) restricted to positive values."""
    shares, log_positive = weights / weights.sum(), log_ndtr(t)

    def compute_surplus(x: Array, below: Array) -> Array:
        # This form is accurate for small fractions, unlike one minus the upper probability.
        surplus: Array = -np.expm1(log_ndtr(t - x[:, None]) - log_positive) @ shares - below
        return surplus

    from scipy.optimize.elementwise import find_root  # imported here because the import takes a tenth of a second

    # Every component exceeds this value with a probability of less than exp(-800).
    upper = max(t.max(), 0.0) + 40.0
    found = find_root(compute_surplus, (0.0, upper), args=(fractions,), tolerances={"xrtol": _ROOT_TOLERANCE})
    return np.asarray(found.x)


def _interpolate_percentiles(nodes: Array, shares: Array, fractions: Array) -> Array:
    # The share between two nodes is the integral of the polynomial through the six nearest nodes. Shares vanish at
    # both ends, so missing nodes count as zero.
    between = np.convolve(shares, np.array([11, -93, 802, 802, -93, 11]) / 1440)[3:-3]
    cumulative = np.maximum.accumulate(np.append(0.0, np.cumsum(between)))
    # Interpolation is accurate as a function of normal scores, because nearly normal marginals are nearly linear.
    scores, kept = np.unique(ndtri(np.clip(cumulative / cumulative[-1], 0.0, 1.0)), return_index=True)
    scores, nodes = scores[1:-1], nodes[kept[1:-1]]  # without the infinities
    percentiles: Array = scipy.interpolate.PchipInterpolator(scores, nodes)(
        np.clip(ndtri(fractions), scores[0], scores[-1])
    )
    return percentiles
