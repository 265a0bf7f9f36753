"""Learned fraction of people, from published forces."""

import math
from typing import NamedTuple

from scipy.stats import t as student_t

from affordance.protocols.published import Published, PublishedTable

_CONFIDENCE = 0.95


class Fraction(NamedTuple):
    """Learned fraction of a group.

    Attributes:
        mean: Estimate of f.
        se: Standard error of the estimate.
        low: Lower end of the 95 % interval.
        high: Upper end of the 95 % interval.
    """

    mean: float
    se: float
    low: float
    high: float


def estimate_people_fraction(people: PublishedTable) -> Fraction:
    """Estimates the learned fraction of people, with its error to first order for independent forces.

    Means and 95 % intervals by Student's t are published; the covariance of the two forces over people is not.

    Raises:
        BadValueError: The table lacks a row that is needed.
    """
    end, family, weight = (people.get(name) for name in ("end_N", "family_N", "weight_N"))
    quantile = float(student_t.ppf(0.5 + _CONFIDENCE / 2.0, people.get("num_people").value - 1.0))
    scale = weight.value - family.value
    fraction = (end.value - family.value) / scale
    se = math.hypot(_estimate_se(end, quantile), (1.0 - fraction) * _estimate_se(family, quantile)) / scale
    return Fraction(fraction, se, fraction - quantile * se, fraction + quantile * se)


def _estimate_se(published: Published, quantile: float) -> float:
    """Computes the standard error behind a published interval."""
    return 0.5 * (published.high - published.low) / quantile
