"""Moments of a normal variable restricted to positive values, and the normal distribution that has given ones."""

import numpy as np
from scipy.special import erfcx

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
