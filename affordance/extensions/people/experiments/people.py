"""Published results of people, for comparison with observers: means, intervals, spread between people."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from scipy.stats import t as student_t

from affordance.experiments.shared.observer_numbers import PeopleSpread
from affordance.reporting.statistics import CONFIDENCE


class Published(NamedTuple):
    """Published mean over people with its 95 % interval, in SI units; NaN if no interval is published."""

    value: float
    low: float = math.nan
    high: float = math.nan


def describe_people(people: Mapping[str, Published]) -> dict[str, Any]:
    """Returns people's means as NAME and their intervals, if published, as NAME_ci95, as in metrics.json."""
    numbers: dict[str, Any] = {}
    for name, each in people.items():
        numbers[name] = each.value
        if math.isfinite(each.low):
            numbers[f"{name}_ci95"] = [each.low, each.high]
    return numbers


def find_spread(published: Published, count: int, source: str) -> PeopleSpread:
    """Computes the standard deviation between people from the interval of their mean (Student's t)."""
    quantile = float(student_t.ppf(0.5 + CONFIDENCE / 2.0, count - 1.0))
    return PeopleSpread(0.5 * (published.high - published.low) * math.sqrt(count) / quantile, source)
