"""A multivariate normal distribution restricted to the positive orthant: x ~ N(mean, covariance) given x > 0.

Densities are positive, so every mode, mean, percentile, sample and evidence that leaves the belief is of this
distribution. Coordinates that do not covary are treated apart, which makes the common cases exact: a coordinate on
its own is a univariate truncated normal distribution, one of a pair needs a single quadrature.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson
from scipy.interpolate import PchipInterpolator
from scipy.optimize import nnls
from scipy.sparse.csgraph import connected_components
from scipy.stats import multivariate_normal, norm, truncnorm

Array = NDArray[np.float64]

# The marginal of a coordinate that covaries with others is tabulated between these two tail probabilities of its own
# truncated distribution; what lies beyond is lost. 1025 nodes put the error of a percentile below 1e-6 of the SD.
_TAIL = 1e-12
_NUM_NODES = 1025
# Relative covariance below which two coordinates count as unrelated (it is rounding error).
_UNRELATED = 1e-12


def compute_mode(mean: Array, precision: Array, floor: float) -> Array:
    """Computes the most probable point with every coordinate at least ``floor``.

    Args:
        mean: Mean of the unrestricted distribution, shape (M,).
        precision: Its inverse covariance, shape (M, M).
        floor: Smallest value allowed.

    Returns: The mode, shape (M,).
    """
    if (mean >= floor).all():
        return mean.copy()
    # (x - mean)^T precision (x - mean) = |L^T (x - mean)|^2: non-negative least squares in x - floor.
    root = np.linalg.cholesky(precision).T
    return floor + nnls(root, root @ (mean - floor))[0]


def compute_log_mass(mean: Array, covariance: Array) -> float:
    """Computes log P(x > 0) of the unrestricted distribution."""
    return sum(_log_mass(mean[block], covariance[np.ix_(block, block)]) for block in _blocks(covariance))


def compute_percentiles(mean: Array, covariance: Array, fractions: Array) -> Array:
    """Computes percentiles of each coordinate's marginal.

    Args:
        mean: Mean of the unrestricted distribution, shape (M,).
        covariance: Its covariance, shape (M, M).
        fractions: Probabilities in (0, 1), shape (P,).

    Returns: Percentiles, shape (P, M).
    """
    percentiles = np.empty((len(fractions), len(mean)))
    for block in _blocks(covariance):
        for i, coordinate in enumerate(block):
            if len(block) == 1:
                alone = _truncate(mean[coordinate], covariance[coordinate, coordinate])
                percentiles[:, coordinate] = truncnorm.ppf(fractions, **alone)
            else:
                nodes, density = _tabulate_marginal(mean[block], covariance[np.ix_(block, block)], i)
                cumulative = cumulative_simpson(density, x=nodes, initial=0.0)
                cumulative, kept = np.unique(cumulative / cumulative[-1], return_index=True)
                percentiles[:, coordinate] = PchipInterpolator(cumulative, nodes[kept])(fractions)
    return percentiles


def compute_mean(mean: Array, covariance: Array) -> Array:
    """Computes the mean of each coordinate, shape (M,)."""
    result = np.empty_like(mean)
    for block in _blocks(covariance):
        for i, coordinate in enumerate(block):
            if len(block) == 1:
                result[coordinate] = truncnorm.mean(**_truncate(mean[coordinate], covariance[coordinate, coordinate]))
            else:
                nodes, density = _tabulate_marginal(mean[block], covariance[np.ix_(block, block)], i)
                result[coordinate] = np.trapezoid(density * nodes, nodes) / np.trapezoid(density, nodes)
    return result


def draw_samples(mean: Array, covariance: Array, rng: np.random.Generator, num_samples: int) -> Array:
    """Draws independent samples, exactly distributed, shape (num_samples, M).

    Within a block coordinates are proposed one after the other, each from its normal distribution given those before
    it, truncated at zero; a proposal is accepted with the product of the truncations' probabilities (rejection from
    the proposal of Geweke, Hajivassiliou & Keane). The least positive coordinate comes first, at no cost.
    """
    samples = np.empty((num_samples, len(mean)))
    for block in _blocks(covariance):
        block_covariance = covariance[np.ix_(block, block)]
        order = np.argsort(mean[block] / np.sqrt(np.diag(block_covariance)))
        root = np.linalg.cholesky(block_covariance[np.ix_(order, order)])
        accepted = np.empty((0, len(block)))
        while len(accepted) < num_samples:
            proposals, weights = _propose(mean[block][order], root, rng, max(num_samples, 64))
            accepted = np.concatenate([accepted, proposals[rng.random(len(weights)) < weights]])
        samples[:, block[order]] = accepted[:num_samples]
    return samples


def _propose(mean: Array, root: Array, rng: np.random.Generator, num_samples: int) -> tuple[Array, Array]:
    """Proposes positive points and their acceptance probabilities; root is the covariance's Cholesky factor."""
    z = np.empty((num_samples, len(mean)))
    weights = np.ones(num_samples)
    for i, pivot in enumerate(np.diag(root)):
        lower = -(mean[i] + z[:, :i] @ root[i, :i]) / pivot
        upper_tail = norm.sf(lower)
        if i > 0:
            weights *= upper_tail
        # isf of the upper tail keeps its digits where the cdf would be rounded to one.
        z[:, i] = norm.isf(upper_tail * (1.0 - rng.random(num_samples)))
        z[:, i] = np.maximum(z[:, i], lower)
    return np.maximum(mean + z @ root.T, np.finfo(float).tiny), weights


def _truncate(mean: float, variance: float) -> dict[str, float]:
    """SciPy's parameters of a univariate normal distribution restricted to positive values."""
    sd = float(np.sqrt(variance))
    return {"a": -mean / sd, "b": np.inf, "loc": mean, "scale": sd}


def _blocks(covariance: Array) -> Iterator[NDArray[np.intp]]:
    """Index sets of coordinates that covary, directly or through others."""
    sds = np.sqrt(np.diag(covariance))
    related = np.abs(covariance) > _UNRELATED * np.outer(sds, sds)
    num_blocks, labels = connected_components(related, directed=False)
    for label in range(num_blocks):
        yield np.flatnonzero(labels == label)


def _log_mass(mean: Array, covariance: Array) -> float:
    if len(mean) == 1:
        return float(norm.logcdf(mean[0] / np.sqrt(covariance[0, 0])))
    # P(x > 0) = P(-x < 0). Beyond three coordinates SciPy integrates by lattice: a fixed seed keeps it a function.
    return float(multivariate_normal.logcdf(np.zeros(len(mean)), -mean, covariance, rng=np.random.default_rng(0)))


def _tabulate_marginal(mean: Array, covariance: Array, i: int) -> tuple[Array, Array]:
    """Tabulates the marginal density of coordinate i, up to a factor: p(x_i) P(all others > 0 | x_i)."""
    alone = _truncate(mean[i], covariance[i, i])
    nodes = np.linspace(truncnorm.ppf(_TAIL, **alone), truncnorm.isf(_TAIL, **alone), _NUM_NODES)
    others = np.delete(np.arange(len(mean)), i)
    gain = covariance[others, i] / covariance[i, i]
    conditional_covariance = covariance[np.ix_(others, others)] - np.outer(gain, covariance[i, others])
    conditional_means = mean[others] + np.outer(nodes - mean[i], gain)
    if len(others) == 1:
        log_others = norm.logcdf(conditional_means[:, 0] / np.sqrt(conditional_covariance[0, 0]))
    else:
        log_others = np.array([_log_mass(m, conditional_covariance) for m in conditional_means])
    log_density = truncnorm.logpdf(nodes, **alone) + log_others
    return nodes, np.exp(log_density - log_density.max())
