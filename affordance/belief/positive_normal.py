"""Moments of a normal variable restricted to positive values, and the normal distribution that has given ones."""

import numpy as np
from scipy.special import erfcx, log_ndtr

from affordance.arrays import Array

# Ratio of mean and SD above which the restriction changes neither by more than 1e-15.
_UNRESTRICTED = 9.0
# Least ratio of mean and SD that is represented; an exponential distribution has 1.
_LEAST_RATIO = 1.002
_STEPS = 60


def compute_moments(mean: Array, sd: Array) -> tuple[Array, Array]:
    """Computes mean and SD of N(mean, sd^2) restricted to positive values."""
    a = mean / sd
    hazard = np.sqrt(2.0 / np.pi) / erfcx(-a / np.sqrt(2.0))
    return sd * (a + hazard), sd * np.sqrt(np.maximum(1.0 - hazard * (a + hazard), 1e-300))


def find_untruncated(mean: Array, sd: Array) -> tuple[Array, Array]:
    """Finds mean and SD of the normal distribution that has these ones when restricted to positive values.

    Their ratio determines the unrestricted ratio, which is found by bisection. A ratio of one or less, which no such
    distribution has, is replaced by the least one; the mean is kept.
    """
    center, scale = mean.copy(), sd.copy()
    cut = mean < _UNRESTRICTED * sd
    ratio = np.maximum(mean[cut] / sd[cut], _LEAST_RATIO)
    low, high = np.full(ratio.shape, -40.0), ratio
    for _ in range(_STEPS if ratio.size else 0):
        middle = 0.5 * (low + high)
        one, other = compute_moments(middle, np.ones_like(middle))
        is_low = one < ratio * other
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    scale[cut] = mean[cut] / compute_moments(high, np.ones_like(high))[0]
    center[cut] = high * scale[cut]
    return center, scale


# Gauss-Legendre nodes on [0, 1] for the moments of one of two densities; steps of the iteration, and its tolerance.
_NODES, _WEIGHTS = (0.5 * values for values in np.polynomial.legendre.leggauss(64))
_NODES = _NODES + 0.5
_PAIR_STEPS, _PAIR_TOLERANCE = 40, 1e-4


def compute_pair_moments(mean: Array, covariance: Array, around: Array, width: Array) -> tuple[Array, Array]:
    """Computes means and SDs of two normal variables restricted to positive values, (B, 2) each.

    ``mean`` and ``covariance`` are those of the unrestricted distribution, (B, 2) and (B, 2, 2). The densities are
    integrated from 6 widths below ``around`` to 8 above, (B, 2) each.
    """
    sds = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    correlation = np.clip(covariance[:, 0, 1] / sds.prod(axis=1), -1.0 + 1e-12, 1.0 - 1e-12)[:, None]
    means, spreads = [], []
    for i in (0, 1):
        low = np.maximum(around[:, i] - 6.0 * width[:, i], 0.0)[:, None]
        x = low + (around[:, i, None] + 8.0 * width[:, i, None] - low) * _NODES
        t = (x - mean[:, i, None]) / sds[:, i, None]
        other = mean[:, 1 - i, None] / sds[:, 1 - i, None] + correlation * t
        log_p = -0.5 * t**2 + log_ndtr(other / np.sqrt(1.0 - correlation**2))
        p = np.exp(log_p - log_p.max(axis=1, keepdims=True)) * _WEIGHTS
        p /= p.sum(axis=1, keepdims=True)
        means.append((p * x).sum(axis=1))
        spreads.append(np.sqrt((p * (x - means[-1][:, None]) ** 2).sum(axis=1)))
    return np.stack(means, axis=1), np.stack(spreads, axis=1)


def find_pair(mean: Array, sd: Array, center: Array, covariance: Array) -> tuple[Array, Array]:
    """Finds two unrestricted normal variables that have these means and SDs when restricted to positive values.

    The correlation stays. Where the iteration does not settle, the best of its steps is returned.

    Args:
        mean: Means, (B, 2).
        sd: SDs, (B, 2).
        center: Means of the unrestricted distribution to start from, (B, 2).
        covariance: Its covariance, (B, 2, 2).
    """
    best, best_covariance, least = center.copy(), covariance.copy(), np.full(len(center), np.inf)
    left = np.arange(len(center))
    for _ in range(_PAIR_STEPS):
        found, spread = compute_pair_moments(center, covariance, mean[left], sd[left])
        error = (np.abs(found - mean[left]) / mean[left] + np.abs(spread / sd[left] - 1.0)).max(axis=1)
        better = error < least[left]
        least[left[better]] = error[better]
        best[left[better]], best_covariance[left[better]] = center[better], covariance[better]
        going = least[left] >= _PAIR_TOLERANCE
        left = left[going]
        center, covariance, found, spread = (each[going] for each in (center, covariance, found, spread))
        if not len(left):
            break
        variance = np.diagonal(covariance, axis1=1, axis2=2)
        change = np.clip(sd[left] / spread, 0.8, 1.25)
        gain = np.minimum(variance / spread**2, 4.0)
        pull = (change**2 - 1.0) * (found - center) * (variance > 1.5 * spread**2)
        center = center + gain * (mean[left] - found) - pull
        covariance = covariance * change[:, :, None] * change[:, None]
    return best, best_covariance
