"""Numbers of the observers of every learner, from which an experiment that people have not done is predicted."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from affordance.belief.learners import list_learners
from affordance.experiments.shared.observers import Setup


class PeopleSpread(NamedTuple):
    """Between-person standard deviation of a measure, and its source."""

    sd: float
    source: str


class ObserverNumbers(NamedTuple):
    """Numbers of every observer, with their meanings and the known spread between people.

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
    """Applies ``measure`` to the setup of every learner, and keeps the numbers that have a meaning."""
    found = {}
    for learner in list_learners(setup.settings.learner):
        numbers = measure(setup.change(learner=learner))
        found[learner.name] = {name: numbers[name] for name in meanings}
    return ObserverNumbers(found, meanings)
