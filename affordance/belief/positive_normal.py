"""Finds a normal distribution from its moments after restriction to positive values."""

import numpy as np

from affordance.arrays import Array
from affordance.belief.minimax_tilting import compute_hazard

# Ratio of mean and SD above which the restriction changes neither by more than 1e-15.
_UNRESTRICTED = 9.0
# Least ratio of mean and SD that is represented; an exponential distribution has 1.
_LEAST_RATIO = 1.002
_STEPS = 60


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
