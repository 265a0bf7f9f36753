"""What learners predict of people who have not done an experiment, and which measure would tell them apart best."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.protocols.people import Spread
from affordance.reporting.statistics import Estimate, estimate_mean

# A difference of less than so many standard deviations between people is not called one (Cohen 1988: "small").
_SMALL = 0.2
# A test of two groups is to find a difference there is with this probability, and one there is not with that.
_POWER, _SIGNIFICANCE = 0.9, 0.05
# Relative spread of what is the same but for rounding.
_ROUNDING = 1e-12
# The middle of the observers that is shown as their spread.
_SPREAD = (0.05, 0.95)


class Prediction(NamedTuple):
    """What one learner predicts of one measure.

    Attributes:
        mean: Over observers, with its 95 % interval.
        sd: Standard deviation between observers.
        low: The 5th percentile of observers.
        high: The 95th percentile.
        values: Of each observer, (R,).
    """

    mean: Estimate
    sd: float
    low: float
    high: float
    values: Array


class Contrast(NamedTuple):
    """How well one measure tells two learners apart.

    Attributes:
        measure: Its name.
        learners: The two.
        difference: Of their means, the second's less the first's.
        effect: The difference over the standard deviation between people, or, where that is not known, observers.
        superiority: Probability that of two people, one of each learner, the second's value is the larger; equal
            values count half.
        num_people: In each of two groups, that a test of significance 0.05 and power 0.9 needs; at least 2.
        is_of_people: Truth value, true if the spread between people is known.
    """

    measure: str
    learners: tuple[Learner, Learner]
    difference: float
    effect: float
    superiority: float
    num_people: float
    is_of_people: bool = False


def summarise(values: Array) -> Prediction:
    """Summarises a measure of R observers, (R,)."""
    low, high = (float(value) for value in np.quantile(values, _SPREAD))
    sd = float(values.std(ddof=1))
    return Prediction(estimate_mean(values), sd if sd > _ROUNDING * np.abs(values).max() else 0.0, low, high, values)


def contrast_learners(
    predictions: Mapping[str, Mapping[Learner, Prediction]], people_sd: Mapping[str, float] | None = None
) -> list[Contrast]:
    """Compares all pairs of learners by all measures; the best measure for a pair comes first.

    Simulated observers differ less than people, who push more or less hard besides. Where the spread between people
    is known, from an experiment with the same measure, it adds to that of the observers; such measures come before
    those of which nothing is known of people.

    Args:
        predictions: By measure and learner, from ``predict``.
        people_sd: Standard deviation between people, by measure, that observers do not have; none if it is not known.
    """
    contrasts = []
    for measure, by_learner in predictions.items():
        extra = (people_sd or {}).get(measure, 0.0)
        for first, second in itertools.combinations(by_learner, 2):
            one, other = by_learner[first], by_learner[second]
            difference = float(other.mean.mean - one.mean.mean)
            sd = math.sqrt(0.5 * (one.sd**2 + other.sd**2) + extra**2)
            effect = difference / sd if sd > 0.0 else math.copysign(math.inf, difference) if difference else 0.0
            contrasts.append(
                Contrast(
                    measure,
                    (first, second),
                    difference,
                    effect,
                    compute_superiority(one.values, other.values, extra),
                    count_people(effect),
                    measure in (people_sd or {}),
                )
            )
    return sorted(contrasts, key=lambda contrast: (-contrast.is_of_people, -abs(contrast.effect)))


def compute_superiority(first: Array, second: Array, extra_sd: float) -> float:
    """Probability that a value of the second exceeds one of the first, both with a further normal deviation."""
    differences = second[:, None] - first
    if extra_sd > 0.0:
        return float(norm.cdf(differences / (math.sqrt(2.0) * extra_sd)).mean())
    return float((differences > 0.0).mean() + 0.5 * (differences == 0.0).mean())


def count_people(effect: float) -> float:
    """People in each of two groups that a two-sided test of their means needs (normal approximation), at least 2."""
    if effect == 0.0:
        return math.inf
    quantiles = norm.ppf(1.0 - 0.5 * _SIGNIFICANCE) + norm.ppf(_POWER)
    return max(2.0, math.ceil(2.0 * (quantiles / effect) ** 2))


def format_predictions(
    meanings: Mapping[str, str],
    predictions: Mapping[str, Mapping[Learner, Prediction]],
    contrasts: Sequence[Contrast],
    spreads: Mapping[str, Spread] | None = None,
) -> str:
    """Writes predictions as a table, and which measure tells each pair of learners apart best.

    Args:
        meanings: What each measure is, in words; those that are not there are called by their names alone.
        predictions: By measure and learner.
        contrasts: From ``contrast_learners``.
        spreads: Spreads between people by measure, where they are known.
    """
    lines = []
    for name, by_learner in predictions.items():
        lines.append(f"{name}: {meanings[name]}" if meanings.get(name) else name)
        for learner, found in by_learner.items():
            interval = f"[{found.mean.low:.3g}, {found.mean.high:.3g}]"
            spread = f"{found.low:.3g} to {found.high:.3g}"
            lines.append(
                f"    {learner.value:12s} mean {float(found.mean.mean):8.3g} {interval:18s}"
                f" SD between observers {found.sd:6.2g}, nine in ten from {spread}"
            )
        if spreads and name in spreads:
            lines.append(f"    {'people':12s} SD between people {spreads[name].sd:.2g} ({spreads[name].source})")
    told: set[tuple[Learner, Learner]] = set()
    for contrast in contrasts:
        if contrast.learners not in told:
            told.add(contrast.learners)
            lines.append(describe_contrast(contrast))
    return "\n".join(lines)


def describe_contrast(contrast: Contrast) -> str:
    """Says whether a measure tells two learners apart: in people or, if nothing is known of them, observers."""
    pair = " and ".join(learner.value for learner in contrast.learners)
    if math.isinf(contrast.num_people):
        return f"{pair} are not told apart by any of these"
    between = "people" if contrast.is_of_people else "observers"
    size = f"{contrast.difference:.3g}, {abs(contrast.effect):.2g} times the spread between {between}"
    if not contrast.is_of_people:
        return (
            f"{pair} are told apart best by {contrast.measure}: they differ by {size}; how much people differ in it "
            "is not given (numbers.NAME.people), so whether they would show it is not known"
        )
    if abs(contrast.effect) < _SMALL:
        return (
            f"{pair} are not told apart by any of these: they differ most in {contrast.measure}, by {size}; it would "
            f"take {contrast.num_people:.0f} people in each group"
        )
    return (
        f"{pair} are told apart best by {contrast.measure}: they differ by {size}; "
        f"{contrast.num_people:.0f} people in each group would do"
    )
