"""Predictions of all learners before data collection, and measures that discriminate between learners."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy  # not scipy.stats, which takes half a second to import: it is imported on first use

from affordance.arrays import Array
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread
from affordance.experiments.shared.observers import Setup
from affordance.files.atomic import to_plain, write_json
from affordance.reporting.formatting import break_line, format_number, tabulate
from affordance.reporting.statistics import Estimate, estimate_mean
from affordance.runs.repeats import list_versions, prepare_folder

# Smallest reported effect size ("small" in Cohen 1988).
_SMALL = 0.2
# Default power of a test between two groups, and its two-sided significance level.
POWER, SIGNIFICANCE = 0.9, 0.05
# Largest size of a group that is reported exactly.
MANY = 100_000
# Largest relative spread of values that differ only by rounding.
_ROUNDING = 1e-12
# Quantiles of observers that are reported as their spread.
_SPREAD = (0.05, 0.95)


class Prediction(NamedTuple):
    """Predicted measure of R observers with the same learner."""

    mean: Estimate
    sd: float
    low: float  # 5 % quantile
    high: float  # 95 % quantile
    values: Array  # (R,)


class Contrast(NamedTuple):
    """Difference between two learners in one measure."""

    measure: str
    learners: tuple[str, str]
    difference: float  # mean of the second learner minus mean of the first
    # Cohen's d, with the standard deviation between participants or, if unknown, between observers.
    effect: float
    # Probability of superiority: a participant with the second learner has a larger value than a participant with the
    # first. Ties count half.
    superiority: float
    num_people: float  # required size of each of two groups for significance 0.05, at least 2
    is_of_people: bool = False  # True if the standard deviation between participants is known
    power: float = POWER


def summarise(values: Array) -> Prediction:
    """Summarises the values of R observers, (R,)."""
    low, high = (float(value) for value in np.quantile(values, _SPREAD))
    sd = float(values.std(ddof=1))
    return Prediction(estimate_mean(values), sd if sd > _ROUNDING * np.abs(values).max() else 0.0, low, high, values)


def contrast_learners(
    predictions: Mapping[str, Mapping[str, Prediction]],
    people_sd: Mapping[str, float] | None = None,
    *,
    power: float = POWER,
) -> list[Contrast]:
    """Compares all pairs of learners on all measures, and sorts the comparisons by decreasing effect size.

    Simulated observers vary less than humans. If the standard deviation between human participants is known for a
    measure, it is added. Measures with a known standard deviation come first.
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
                    count_people(effect, power),
                    measure in (people_sd or {}),
                    power,
                )
            )
    return sorted(contrasts, key=lambda contrast: (-contrast.is_of_people, -abs(contrast.effect)))


def compute_superiority(first: Array, second: Array, extra_sd: float) -> float:
    """Computes the probability of superiority of the second group, with added normal noise on all values.

    Args:
        first: Values of the first group, (M,).
        second: Values of the second group, (N,).
        extra_sd: Standard deviation of the noise. If it is 0, ties count half.
    """
    differences = second[:, None] - first
    if extra_sd > 0.0:
        return float(scipy.stats.norm.cdf(differences / (math.sqrt(2.0) * extra_sd)).mean())
    return float((differences > 0.0).mean() + 0.5 * (differences == 0.0).mean())


def count_people(
    effect: float, power: float = POWER, *, groups: int = 2, significance: float = SIGNIFICANCE
) -> float:
    """Computes the required group size of a two-sided t test, at least 2.

    Power is computed with the noncentral t distribution. Sizes above ``MANY`` are normal approximations.

    Args:
        effect: Cohen's d. In a paired test, this is the mean difference divided by the SD of differences.
        power: Power.
        groups: 2 for a test between two groups; 1 for a paired or one-sample test.
        significance: Significance level.
    """
    if effect == 0.0:
        return math.inf
    quantiles = scipy.stats.norm.ppf(1.0 - 0.5 * significance) + scipy.stats.norm.ppf(power)
    count = max(2.0, math.ceil(groups * (quantiles / effect) ** 2))
    while count <= MANY and _compute_power(effect, count, groups, significance) < power:
        count += 1.0
    return count


def _compute_power(effect: float, count: float, groups: int, significance: float) -> float:
    """Computes the power of a t test for a group size."""
    free, shift = groups * (count - 1.0), abs(effect) * math.sqrt(count / groups)
    if math.isinf(shift):
        return 1.0
    critical = scipy.stats.t.ppf(1.0 - 0.5 * significance, free)
    return float(scipy.stats.nct.sf(critical, free, shift) + scipy.stats.nct.cdf(-critical, free, shift))


def describe_best(predictions: Mapping[str, Mapping[str, Prediction]], contrasts: Sequence[Contrast]) -> str:
    """Describes in three sentences the measure that best discriminates between two learners, and its selection."""
    if not contrasts:
        return "There is only one learner, so there is nothing to distinguish."
    text = f"{describe_contrast(contrasts[0])}."
    if abs(contrasts[0].effect) >= _SMALL:
        pairs = len(contrasts) // len(predictions)
        text += (
            f" It is the best of {len(predictions)} measures for {pairs} pairs of learners, picked after they were"
            " simulated; a measure to be tested must be chosen before."
        )
    return f"{text} --details prints all measures and pairs."


def format_predictions(
    meanings: Mapping[str, str],
    predictions: Mapping[str, Mapping[str, Prediction]],
    contrasts: Sequence[Contrast],
    spreads: Mapping[str, PeopleSpread] | None = None,
    width: int = 0,
) -> str:
    """Formats predictions, SDs between participants, and the most discriminative measure for each pair of learners.

    Args:
        meanings: Description of each measure.
        predictions: Prediction by measure and learner. Measures that are equal for all observers share one line.
        contrasts: Differences between learners.
        spreads: Known SDs between participants, by measure.
        width: Largest line length; 0 for no limit.
    """
    lines, same = [], []
    for name, by_learner in predictions.items():
        first, *_ = by_learner.values()
        if len(by_learner) > 1 and all(each.sd == 0.0 and each.low == first.low for each in by_learner.values()):
            same.append(f"{name} {_show(first.low)}")
            continue
        meaning = meanings.get(name) or meanings.get(name.split("[")[0])
        lines.append(f"{name}: {meaning}" if meaning else name)
        rows = [["", "mean", "95 % interval", "SD", "90 % of observers"]]
        for learner, found in by_learner.items():
            interval = f"[{_show(found.mean.low)}, {_show(found.mean.high)}]"
            spread = f"{_show(found.low)} to {_show(found.high)}"
            rows.append([learner, _show(found.mean.mean), interval, _show(found.sd, 2), spread])
        lines += [f"    {line}" for line in tabulate(rows, (1, 3), max(width - 4, 0))]
        if spreads and name in spreads:
            lines.append(f"    SD between people {spreads[name].sd:.2g} ({spreads[name].source})")
    if same:
        lines.append(f"The same for all observers of all learners: {', '.join(same)}")
    told: set[tuple[str, str]] = set()
    for contrast in contrasts:
        if contrast.learners not in told:
            told.add(contrast.learners)
            lines.append(describe_contrast(contrast))
    return "\n".join(part for line in lines for part in break_line(line, width))


def _show(value: Array | float, digits: int = 3) -> str:
    """Formats a number, without an exponent if it is large."""
    text = f"{float(value):.{digits}g}"
    return format_number(float(value), digits) if "e+" in text else text


def describe_contrast(contrast: Contrast) -> str:
    """Describes effect size, probability of superiority and required group size of a difference between learners."""
    pair = " and ".join(contrast.learners)
    if math.isinf(contrast.num_people):
        return f"{pair} are not distinguished by any of these"
    between = "people" if contrast.is_of_people else "observers"
    size = f"difference {contrast.difference:.3g}, Cohen's d = {abs(contrast.effect):.2g} (spread between {between})"
    number = f"{contrast.num_people:.0f}" if contrast.num_people <= MANY else f"more than {MANY}"
    first, second = contrast.learners
    count = f"{number} participants who learn like {first} and {number} who learn like {second}"
    test = f"(two-sided t test, {SIGNIFICANCE:.2g}, power {contrast.power:.2g})".replace("0.", ".")
    if not contrast.is_of_people:
        test += " if people differ no more than observers, which is not known"
    if abs(contrast.effect) < _SMALL:
        return (
            f"{pair} are not distinguished by any of these: they differ most in {contrast.measure}: {size}; it would"
            f" take {count} {test}"
        )
    return f"{pair} are distinguished best by {contrast.measure}: {size}; {count} suffice {test}"


# Name of the predictions file in the results folder of an experiment.
FILE = "predictions.json"


class Predicted(NamedTuple):
    """Predictions of all learners.

    Attributes:
        predictions: Prediction by measure and learner.
        meanings: Description of each measure.
        spreads: Known SDs between participants, by measure.
        contrasts: Differences between learners, in the order of ``contrast_learners``.
        path: Predictions file.
    """

    predictions: Mapping[str, Mapping[str, Prediction]]
    meanings: Mapping[str, str]
    spreads: Mapping[str, PeopleSpread]
    contrasts: Sequence[Contrast]
    path: Path


def predict(
    name: str, setup: Setup, measure: Callable[[Setup], ObserverNumbers], *, power: float = POWER
) -> Predicted:
    """Simulates observers with each learner, compares the learners, and writes a predictions file.

    Finished observers are cached, so that later runs do not simulate them again.

    Args:
        name: Name of the experiment and of its results folder.
        setup: Setup of the experiment.
        measure: Function that simulates observers with each learner and returns their measures.
        power: Power of the test for which the number of participants is computed.
    """
    found = measure(setup)
    folder = prepare_folder(setup.out / name)
    values = _sort_by_number(found.values)
    predictions = {
        number: {learner: summarise(each) for learner, each in by_learner.items()}
        for number, by_learner in values.items()
    }
    means = {
        number: float(np.mean([each.mean.mean for each in by_learner.values()]))
        for number, by_learner in predictions.items()
    }
    people = found.find_spreads(means)
    bases = {number: number if number in people else number.split("[")[0] for number in predictions}
    spreads = {number: people[base] for number, base in bases.items() if base in people}
    contrasts = contrast_learners(predictions, {number: spread.sd for number, spread in spreads.items()}, power=power)
    content = _describe(predictions, spreads, contrasts)
    run = {"seed": setup.seed, "repeats": setup.observers, "config": setup, "versions": list_versions()}
    write_json(folder / FILE, {**content, **run})
    return Predicted(predictions, found.meanings, spreads, contrasts, folder / FILE)


def _sort_by_number(found: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Array]]:
    """Arranges measures by name and learner, (observers,) each. Entries of arrays become separate measures."""
    values: dict[str, dict[str, Array]] = {}
    for learner, numbers in found.items():
        for key, array in numbers.items():
            rows = np.asarray(array, dtype=float).reshape(len(array), -1)
            for column in range(rows.shape[1]):
                name = key if rows.shape[1] == 1 else f"{key}[{column}]"
                values.setdefault(name, {})[learner] = rows[:, column]
    return values


def _describe(
    predictions: Mapping[str, Mapping[str, Prediction]],
    spreads: Mapping[str, PeopleSpread],
    contrasts: Sequence[Contrast],
) -> dict[str, Any]:
    """Builds the content of the predictions file."""
    numbers = {
        number: {
            learner: {
                "mean": float(found.mean.mean),
                "mean_ci95": found.mean.ci95,
                "sd": found.sd,
                "p5": found.low,
                "p95": found.high,
            }
            for learner, found in by_learner.items()
        }
        for number, by_learner in predictions.items()
    }
    compared = [
        {{"measure": "number"}.get(name, name): value for name, value in contrast._asdict().items()}
        for contrast in contrasts
    ]
    content = to_plain({"numbers": numbers, "contrasts": compared, "spread_between_people": spreads})
    finite: dict[str, Any] = _keep_finite(content)
    return finite


def _keep_finite(value: Any) -> Any:
    """Replaces infinite numbers and NaN with None, because JSON does not support them."""
    if isinstance(value, Mapping):
        return {name: _keep_finite(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_keep_finite(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
