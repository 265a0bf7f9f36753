"""Numbers of each observer of every learner, and their summaries over observers."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import xarray as xr

from affordance.belief.learners import list_learners
from affordance.experiments.shared.observers import Setup
from affordance.reporting.claims import with_interval


class Measure(NamedTuple):
    """Number of each observer, with the function that summarises it."""

    values: xr.DataArray
    summarise: Callable[[str, xr.DataArray], Mapping[str, Any]]


def mean(values: xr.DataArray) -> Measure:
    """Number that is summarised by its mean."""
    return Measure(values, lambda name, each: {name: each.mean("observer").values[()]})


def mean_with_interval(values: xr.DataArray) -> Measure:
    """Number that is summarised by its mean and the mean's 95 % interval, NAME_ci95."""
    return Measure(values, with_interval)


def median(values: xr.DataArray) -> Measure:
    """Number that is summarised by its median."""
    return Measure(values, lambda name, each: {name: each.median("observer").values[()]})


def total(values: xr.DataArray) -> Measure:
    """Number that is summarised by its sum."""
    return Measure(values, lambda name, each: {name: each.sum("observer").values[()]})


def summarise_measures(measures: Mapping[str, Measure]) -> dict[str, Any]:
    """Summarises the numbers of all observers, as in metrics.json."""
    summaries = (each.summarise(name, each.values) for name, each in measures.items())
    return {key: value for summary in summaries for key, value in summary.items()}


class PeopleSpread(NamedTuple):
    """Between-person standard deviation of a measure, and its source."""

    sd: float
    source: str


class ObserverNumbers(NamedTuple):
    """Numbers of every observer with their meanings, and the known spread between people.

    Attributes:
        values: Numbers of the observers, (observers, ...), by learner and name.
        meanings: Meaning of each number in words, by name.
        find_spreads: Function that returns known standard deviations between people by name, given the predicted
            means by name.
    """

    values: Mapping[str, Mapping[str, Any]]
    meanings: Mapping[str, str] = {}
    find_spreads: Callable[[Mapping[str, float]], Mapping[str, PeopleSpread]] = lambda means: {}


def measure_learners(
    setup: Setup, measure: Callable[[Setup], Mapping[str, Any]], meanings: Mapping[str, str]
) -> ObserverNumbers:
    """Computes the numbers of each observer for every learner. Only numbers with a meaning are kept.

    A number of each observer is an array, or a Measure.
    """
    found = {}
    for learner in list_learners(setup.settings.learner):
        numbers = measure(setup.change(learner=learner))
        chosen = {name: numbers[name] for name in meanings}
        found[learner.name] = {
            name: each.values if isinstance(each, Measure) else each for name, each in chosen.items()
        }
    return ObserverNumbers(found, meanings)
