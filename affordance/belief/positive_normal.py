"""Finds unrestricted normal distributions with given moments after restriction to positive values."""

from collections.abc import Callable

import numpy as np
from scipy.special import log_ndtr

from affordance.arrays import Array
from affordance.belief.minimax_tilting import compute_hazard, compute_mean_excess

# Ratio of mean to SD above which the restriction changes both by less than 1e-15.
_UNRESTRICTED = 9.0
# Smallest ratio of mean to SD after restriction; the limit is 1, an exponential distribution.
_LEAST_RATIO = 1.002
_STEPS = 60
# Joint moments: largest numbers of Newton steps and step halvings, and gain below which a search has converged.
_NEWTON_STEPS, _HALVINGS, _SETTLED = 30, 12, 1e-14
_LEAST_PRECISION = 1e-4  # in units of the SDs after restriction
# Two values: exponents of both values in the terms of the log density, nodes along the first value, and their range
# in SDs below and above its mean.
_POWERS = np.array([(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]).T
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
_REACH = 9.0, 16.0


def _compute_moments(mean: Array) -> tuple[Array, Array]:
    """Computes mean and SD of N(mean, 1) restricted to positive values."""
    hazard = compute_hazard(mean)
    return mean + hazard, np.sqrt(np.maximum(1.0 - hazard * (mean + hazard), 1e-300))


def find_untruncated(mean: Array, sd: Array) -> tuple[Array, Array]:
    """Finds mean and SD of an unrestricted normal distribution from mean and SD after restriction.

    The unrestricted ratio of mean to SD is found by bisection, because it depends only on the ratio after
    restriction. Ratios of one or less are impossible; they are replaced with a slightly larger value, and the mean is
    preserved.
    """
    center, scale = mean.copy(), sd.copy()
    cut = mean < _UNRESTRICTED * sd
    ratio = np.maximum(mean[cut] / sd[cut], _LEAST_RATIO)
    low, high = np.full(ratio.shape, -40.0), ratio
    for _ in range(_STEPS if ratio.size else 0):
        middle = 0.5 * (low + high)
        one, other = _compute_moments(middle)
        is_low = one < ratio * other
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    scale[cut] = mean[cut] / _compute_moments(high)[0]
    center[cut] = high * scale[cut]
    return center, scale


def find_untruncated_joint(
    mean: Array,
    sd: Array,
    correlation: Array,
    center: Array,
    covariance: Array,
    points: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Finds unrestricted joint normal distributions from moments after restriction.

    Restricted normal distributions are an exponential family, so their Kullback-Leibler divergence from a
    distribution with the given moments is convex. Newton's method minimises it. If the moments are impossible, the
    result is the closest distribution.

    Args:
        mean: Means after restriction, (B, M).
        sd: SDs after restriction, (B, M).
        correlation: Correlations after restriction, (B, M, M).
        center: Initial unrestricted means, (B, M).
        covariance: Initial unrestricted covariances, (B, M, M), positive definite.
        points: Quadrature points, (B, M, N), and the logs of their volumes, (B, N). None for two values, whose
            integrals are computed on fixed nodes of the first value and in closed form over the second.

    Returns:
        Unrestricted means, (B, M), and covariances, (B, M, M).
    """
    M, ratio = mean.shape[1], mean / sd
    i, j = np.triu_indices(M)
    # The log density is theta times the features x_i, -x_i x_j for i < j, and -x_i^2 / 2, with x in units of the SDs.
    factors = np.concatenate([np.ones(M), np.where(i == j, -0.5, -1.0)])
    target = factors * np.concatenate([ratio, ratio[:, i] * ratio[:, j] + correlation[:, i, j]], axis=1)
    P = np.linalg.inv(covariance / (sd[..., None] * sd[:, None]))
    theta = np.concatenate([np.matvec(P, center / sd), P[:, i, j]], axis=1)
    if points is None:
        low = np.maximum(ratio[:, :1] - _REACH[0], 0.0)
        half = 0.5 * (ratio[:, :1] + _REACH[1] - low)
        rule = low + half * (_NODES + 1.0), np.log(half * _WEIGHTS)
        theta = _climb(theta, M, lambda theta: _diverge_pair(theta, target, factors, *rule))
    else:
        x = points[0] / sd[..., None]
        features = factors[:, None] * np.concatenate([x, x[:, i] * x[:, j]], axis=1)
        theta = _climb(theta, M, lambda theta: _diverge(theta, target, features, points[1]))
    P = np.linalg.inv(_unpack(theta, M))
    return sd * np.matvec(P, theta[:, :M]), sd[..., None] * P * sd[:, None]


def _unpack(theta: Array, M: int) -> Array:
    """Builds precisions, (B, M, M), from coefficients theta of log densities."""
    P = np.zeros((len(theta), M, M))
    i, j = np.triu_indices(M)
    P[:, i, j] = P[:, j, i] = theta[:, M:]
    return P


def _climb(theta: Array, M: int, diverge: Callable[[Array], tuple[Array, Array, Array]]) -> Array:
    """Minimises a divergence over the coefficients theta by Newton's method with step halving."""
    value, gradient, hessian = diverge(theta)
    for _ in range(_NEWTON_STEPS):
        step = np.linalg.solve(hessian, -gradient[..., None])[..., 0]
        step[(gradient * step).sum(axis=1) > -_SETTLED] = 0.0
        for _ in range(_HALVINGS):
            is_normal = np.linalg.eigvalsh(_unpack(theta + step, M))[:, 0] > _LEAST_PRECISION
            found = diverge(np.where(is_normal[:, None], theta + step, theta))[0]
            is_worse = ~(is_normal & (found <= value + 1e-12 * np.abs(value)))
            if not is_worse.any():
                break
            step[is_worse] *= 0.5
        step[is_worse] = 0.0
        if not step.any():
            break
        theta = theta + step
        value, gradient, hessian = diverge(theta)
    return theta


def _diverge(theta: Array, target: Array, features: Array, log_w: Array) -> tuple[Array, Array, Array]:
    """Computes the divergence, up to a constant, and its first two derivatives by sums over points."""
    log_p = np.vecmat(theta, features) + log_w
    top = log_p.max(axis=1, keepdims=True)
    p = np.exp(log_p - top)
    total = p.sum(axis=1, keepdims=True)
    p /= total
    found = np.matvec(features, p)
    second = (features * p[:, None]) @ features.mT - found[..., None] * found[:, None]
    return (top + np.log(total))[:, 0] - (theta * target).sum(axis=1), found - target, second


def _diverge_pair(theta: Array, target: Array, factors: Array, x: Array, log_w: Array) -> tuple[Array, Array, Array]:
    """Computes the divergence and its derivatives for two values: on nodes x, (B, n), and in closed form over y."""
    h, k, a, b, c = (each[:, None] for each in theta.T)
    s = 1.0 / np.sqrt(c)
    t = (k - b * x) * s
    log_p = h * x - 0.5 * a * x**2 + log_ndtr(t) + 0.5 * t**2 + np.log(s) + log_w
    top = log_p.max(axis=1, keepdims=True)
    p = np.exp(log_p - top)
    total = p.sum(axis=1, keepdims=True)
    moments = [np.ones_like(x), s * compute_mean_excess(t)]  # moments of y given x
    for power in (1, 2, 3):
        moments.append(s * t * moments[-1] + power * s**2 * moments[-2])
    of_x = (p / total)[:, None] * x[:, None] ** np.arange(5.0)[:, None]  # (B, 5, n)
    means = of_x @ np.stack(moments, axis=2)  # means of x^i y^j, (B, 5, 5)
    i, j = _POWERS
    found = factors * means[:, i, j]
    second = factors * factors[:, None] * means[:, i + i[:, None], j + j[:, None]] - found[..., None] * found[:, None]
    return (top + np.log(total))[:, 0] - (theta * target).sum(axis=1), found - target, second
