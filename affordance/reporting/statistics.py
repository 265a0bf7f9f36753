"""Estimates means and proportions over repeats, with confidence intervals."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit  # scipy.stats takes a second to import

from affordance.arrays import Array

CONFIDENCE = 0.95


class Estimate(NamedTuple):
    """Mean over repeats with its 95 % interval. Each array has the shape of a single repeat's value."""

    mean: Array
    low: Array
    high: Array

    @property
    def ci95(self) -> Array:
        """Interval as [low, high] along a new last axis, as stored in metrics.json."""
        return np.stack([self.low, self.high], axis=-1)


def estimate_proportion(hits: Array, count: int) -> Estimate:
    """Estimates a proportion from its number of hits, with Wilson's 95 % interval.

    Halves of hits are allowed. The interval is from Wilson 1927, J. Am. Stat. Assoc. 22:209-212.
    """
    z = ndtri(0.5 + CONFIDENCE / 2.0)
    proportion = np.asarray(hits, dtype=float) / count
    centre = (proportion + z**2 / (2.0 * count)) / (1.0 + z**2 / count)
    half = z / (1.0 + z**2 / count) * np.sqrt(proportion * (1.0 - proportion) / count + z**2 / (4.0 * count**2))
    return Estimate(proportion, np.maximum(0.0, centre - half), np.minimum(1.0, centre + half))


def estimate_mean(values: Array) -> Estimate:
    """Estimates the mean over repeats (first axis), with Student's 95 % interval.

    For a single repeat, the interval has zero width.
    """
    count = len(values)
    mean = values.mean(axis=0)
    if count == 1:
        return Estimate(mean, mean, mean)
    half = stdtrit(count - 1, 0.5 + CONFIDENCE / 2.0) * values.std(axis=0, ddof=1) / np.sqrt(count)
    return Estimate(mean, mean - half, mean + half)
