"""Finds a normal distribution from its moments after restriction to positive values."""

import numpy as np
from scipy.special import log_ndtr

from affordance.arrays import Array
from affordance.belief.minimax_tilting import compute_hazard, compute_mean_excess

# Ratio of mean and SD above which the restriction changes neither by more than 1e-15.
_UNRESTRICTED = 9.0
# Least ratio of mean and SD that is represented; an exponential distribution has 1.
_LEAST_RATIO = 1.002
_STEPS = 60
# Of two values: powers of both and their factors in the log density; nodes along the first value, which reach so many
# SDs below and above its mean; Newton's steps and their halvings at most, and the gain that ends them.
_POWERS, _FACTORS = np.array([(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]), np.array([1.0, 1.0, -0.5, -1.0, -0.5])
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
_REACH = 9.0, 16.0
_NEWTON_STEPS, _HALVINGS, _SETTLED = 30, 12, 1e-14
_LEAST_PRECISION = 1e-4  # in units of the SDs after restriction


def _compute_moments(mean: Array) -> tuple[Array, Array]:
    """Computes mean and SD of N(mean, 1) restricted to positive values."""
    hazard = compute_hazard(mean)
    return mean + hazard, np.sqrt(np.maximum(1.0 - hazard * (mean + hazard), 1e-300))


def find_untruncated(mean: Array, sd: Array) -> tuple[Array, Array]:
    """Finds the normal distribution with a given mean and SD after restriction.

    Their ratio determines the unrestricted ratio, which is found by bisection. No such distribution has a ratio of
    one or less. Such a ratio is replaced by the least possible one, and the mean is kept.
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


def find_untruncated_pair(
    mean: Array, sd: Array, correlation: Array, center: Array, covariance: Array
) -> tuple[Array, Array]:
    """Finds normal distributions of two values with given moments after restriction.

    Restricted normals are an exponential family. Newton's method minimises their Kullback-Leibler divergence from a
    distribution with these moments, which is convex. Where no normal has the moments, the closest one is found.

    Args:
        mean: Means after restriction, (B, 2).
        sd: SDs after restriction, (B, 2).
        correlation: Correlations after restriction, (B,).
        center: Unrestricted means to start with, (B, 2).
        covariance: Unrestricted covariances to start with, (B, 2, 2), positive definite.

    Returns:
        Unrestricted means, (B, 2), and covariances, (B, 2, 2).
    """
    ratio = mean / sd
    low = np.maximum(ratio[:, :1] - _REACH[0], 0.0)
    half = 0.5 * (ratio[:, :1] + _REACH[1] - low)
    rule = low + half * (_NODES + 1.0), np.log(half * _WEIGHTS)
    products = ratio[:, 0] * ratio[:, 1] + correlation
    target = _FACTORS * np.stack([*ratio.T, ratio[:, 0] ** 2 + 1.0, products, ratio[:, 1] ** 2 + 1.0], axis=1)
    P = np.linalg.inv(covariance / (sd[..., None] * sd[:, None]))
    theta = np.concatenate([np.matvec(P, center / sd), P[:, [0, 0, 1], [0, 1, 1]]], axis=1)
    divergence, gradient, hessian = _diverge(theta, target, *rule)
    for _ in range(_NEWTON_STEPS):
        step = np.linalg.solve(hessian, -gradient[..., None])[..., 0]
        step[(gradient * step).sum(axis=1) > -_SETTLED] = 0.0
        for _ in range(_HALVINGS):
            _, _, a, b, c = (theta + step).T
            is_normal = a + c - np.hypot(a - c, 2.0 * b) > 2.0 * _LEAST_PRECISION  # the smaller eigenvalue
            found = _diverge(np.where(is_normal[:, None], theta + step, theta), target, *rule)[0]
            is_worse = ~(is_normal & (found <= divergence + 1e-12 * np.abs(divergence)))
            if not is_worse.any():
                break
            step[is_worse] *= 0.5
        step[is_worse] = 0.0
        if not step.any():
            break
        theta = theta + step
        divergence, gradient, hessian = _diverge(theta, target, *rule)
    P = np.linalg.inv(theta[:, [[2, 3], [3, 4]]])
    return sd * np.matvec(P, theta[:, :2]), sd[..., None] * P * sd[:, None]


def _diverge(theta: Array, target: Array, x: Array, log_w: Array) -> tuple[Array, Array, Array]:
    """Computes the divergence of restricted normals up to a constant, with two derivatives.

    The log density is theta times (x, y, -x^2 / 2, -x y, -y^2 / 2). Nodes integrate over x, (B, n); the integral over
    y has a closed form.
    """
    h, k, a, b, c = (each[:, None] for each in theta.T)
    s = 1.0 / np.sqrt(c)
    t = (k - b * x) * s
    log_p = h * x - 0.5 * a * x**2 + log_ndtr(t) + 0.5 * t**2 + np.log(s) + log_w
    top = log_p.max(axis=1, keepdims=True)
    p = np.exp(log_p - top)
    total = p.sum(axis=1, keepdims=True)
    moments = [np.ones_like(x), s * compute_mean_excess(t)]  # of y given x, by powers
    for power in (1, 2, 3):
        moments.append(s * t * moments[-1] + power * s**2 * moments[-2])
    of_x = (p / total)[:, None] * x[:, None] ** np.arange(5.0)[:, None]  # (B, 5, n)
    means = of_x @ np.stack(moments, axis=2)  # of x^i y^j, (B, 5, 5)
    (i, j), signs = _POWERS.T, _FACTORS * _FACTORS[:, None]
    found = _FACTORS * means[:, i, j]
    second = signs * means[:, i + i[:, None], j + j[:, None]] - found[..., None] * found[:, None]
    divergence = (top + np.log(total))[:, 0] - (theta * target).sum(axis=1)
    return divergence, found - target, second
