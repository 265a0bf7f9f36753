"""Measures of observers, and their summaries over observers."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import xarray as xr

from affordance.belief.learners import list_learners
from affordance.experiments.shared.observers import Setup
from affordance.reporting.claims import with_interval


class Measure(NamedTuple):
    """Values of a measure for all observers, with a function that summarises them."""

    values: xr.DataArray
    summarise: Callable[[str, xr.DataArray], Mapping[str, Any]]


def mean(values: xr.DataArray) -> Measure:
    """Builds a measure that is summarised by its mean."""
    return Measure(values, lambda name, each: {name: each.mean("observer").values[()]})


def mean_with_interval(values: xr.DataArray) -> Measure:
    """Builds a measure that is summarised by its mean and the 95 % confidence interval, NAME_ci95."""
    return Measure(values, with_interval)


def median(values: xr.DataArray) -> Measure:
    """Builds a measure that is summarised by its median."""
    return Measure(values, lambda name, each: {name: each.median("observer").values[()]})


def total(values: xr.DataArray) -> Measure:
    """Builds a measure that is summarised by its sum."""
    return Measure(values, lambda name, each: {name: each.sum("observer").values[()]})


def summarise_measures(measures: Mapping[str, Measure]) -> dict[str, Any]:
    """Summarises measures over observers, for metrics.json."""
    summaries = (each.summarise(name, each.values) for name, each in measures.items())
    return {key: value for summary in summaries for key, value in summary.items()}


class PeopleSpread(NamedTuple):
    """Standard deviation of a measure between people, and its source."""

    sd: float
    source: str


class ObserverNumbers(NamedTuple):
    """Measures of all observers with their meanings, and the known spread between people.

    Attributes:
        values: Values for all observers, (observers, ...), by learner and name of the measure.
        meanings: Meaning of each measure by name.
        find_spreads: Function that returns known standard deviations between people by name of the measure, given
            the predicted means by name.
    """

    values: Mapping[str, Mapping[str, Any]]
    meanings: Mapping[str, str] = {}
    find_spreads: Callable[[Mapping[str, float]], Mapping[str, PeopleSpread]] = lambda means: {}


def measure_learners(
    setup: Setup, measure: Callable[[Setup], Mapping[str, Any]], meanings: Mapping[str, str]
) -> ObserverNumbers:
    """Computes the measures of all observers for each learner.

    Args:
        setup: Setup of the run.
        measure: Function that returns measures, as arrays or Measures, by name.
        meanings: Meaning of each measure by name; other measures are discarded.
    """
    found = {}
    for learner in list_learners(setup.settings.learner):
        numbers = measure(setup.change(learner=learner))
        chosen = {name: numbers[name] for name in meanings}
        found[learner.name] = {
            name: each.values if isinstance(each, Measure) else each for name, each in chosen.items()
        }
    return ObserverNumbers(found, meanings)
