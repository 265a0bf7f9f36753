"""Predictions for an experiment that people have not done yet, from simulated observers of every learner."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.experiments.shared.observer_numbers import ObserverNumbers, PeopleSpread
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.reporting.learner_predictions import (
    POWER,
    Contrast,
    Prediction,
    contrast_learners,
    summarise,
)
from affordance.files.atomic import to_plain, write_json
from affordance.runs.repeats import list_versions, prepare_folder

# File of the predictions, in the folder of the experiment's results.
FILE = "predictions.json"


class Predicted(NamedTuple):
    """Predictions of all learners.

    Attributes:
        predictions: Prediction of each learner, by number and learner.
        meanings: Meaning of each number in words.
        spreads: Known spreads between people, by number.
        contrasts: Contrasts between learners; the one that needs the fewest people comes first.
        path: File of the predictions.
    """

    predictions: Mapping[str, Mapping[str, Prediction]]
    meanings: Mapping[str, str]
    spreads: Mapping[str, PeopleSpread]
    contrasts: Sequence[Contrast]
    path: Path


def predict(
    name: str, setup: Setup, measure: Callable[[Setup], ObserverNumbers], *, power: float = POWER
) -> Predicted:
    """Simulates the observers of every learner; writes their predictions and which numbers separate learners.

    Finished observers are stored as in a run, so a later run does not simulate them again.

    Args:
        name: Name of the experiment, and of its folder within the folder of results.
        setup: Setup of the experiment.
        measure: Function that simulates the observers of every learner and returns their numbers.
        power: Power of the test for which the number of people is computed.
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
    """Arranges numbers by name and learner, each (observers,); each entry of an array becomes a separate number."""
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
    """Returns the predictions as they are written to the file."""
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
    """Replaces every number that is not finite with null, because JSON has no such numbers."""
    if isinstance(value, Mapping):
        return {name: _keep_finite(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_keep_finite(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
