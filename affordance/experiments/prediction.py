"""Predictions of learners for people who have not done a protocol yet: the numbers of every simulated observer."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError
from affordance.experiments.definition import Experiment
from affordance.experiments.runner import run_observers
from affordance.experiments.shared.presented import PresentationExperiment
from affordance.files.atomic import to_plain, write_json
from affordance.protocols.people import list_spreads
from affordance.reporting.learner_predictions import Contrast, PeopleSpread, Prediction, contrast_learners, summarise
from affordance.runs.repeats import list_versions, prepare_folder

# File of the predictions, in the folder of the protocol's results.
FILE = "predictions.json"


class Predicted(NamedTuple):
    """Predictions, meanings and known spreads by number, contrasts of learners, the best first, and their file."""

    predictions: Mapping[str, Mapping[Learner, Prediction]]
    meanings: Mapping[str, str]
    spreads: Mapping[str, PeopleSpread]
    contrasts: Sequence[Contrast]
    path: Path


def predict_protocol(experiment: Experiment, out: Path, *, repeats: int, jobs: int) -> Predicted:
    """Simulates the observers of a protocol with each of its learners, or with every learner if it names only one.

    Observers are cached where ``run_experiment`` caches them, so a later run does not simulate them again. A protocol
    of choices, which each learner makes in a run of its own, or of known densities raises a BadValueError.
    """
    if not isinstance(experiment, PresentationExperiment):
        problem = "is a choice, must be a hold, a clamp, a reach or a look; run it with --learner for each learner"
        raise BadValueError(experiment.section, "blocks", problem)
    if experiment.told:
        problem = "is given, must be omitted where learners are compared: with known densities kinds are not learned"
        raise BadValueError(experiment.section, "observers.told", problem)
    if len(experiment.learners) < 2:
        experiment = experiment.with_learners(tuple(Learner))
    experiment.check_repeats(repeats)
    folder = prepare_folder(out / experiment.name)
    _, arrays = run_observers(experiment, None, folder, repeats=repeats, jobs=jobs)
    values = sort_by_number(experiment.compute_of_observers(arrays), experiment.learners)
    predictions = {
        number: {learner: summarise(of_observers) for learner, of_observers in by_learner.items()}
        for number, by_learner in values.items()
    }
    means = {
        number: float(np.mean([found.mean.mean for found in by_learner.values()]))
        for number, by_learner in predictions.items()
    }
    people = list_spreads(experiment.numbers, experiment.people, means, experiment.objects, experiment.blocks)
    spreads = {number: people[base] for number in predictions if (base := number.split("[")[0]) in people}
    contrasts = contrast_learners(predictions, {number: spread.sd for number, spread in spreads.items()})
    content = _describe(predictions, spreads, contrasts)
    run = {"seed": experiment.seed, "repeats": repeats, "config": experiment, "versions": list_versions()}
    write_json(folder / FILE, {**content, **run})
    meanings = {number: entry.meaning for number, entry in experiment.numbers.items()}
    return Predicted(predictions, meanings, spreads, contrasts, folder / FILE)


def sort_by_number(
    found: Mapping[Learner, Mapping[str, Array]], learners: Sequence[Learner]
) -> dict[str, dict[Learner, Array]]:
    """Sorts the numbers of observers by number and learner, (R,); a list becomes one number per entry."""
    values: dict[str, dict[Learner, Array]] = {}
    for learner in learners:
        for key, array in found[learner].items():
            rows = np.asarray(array, dtype=float).reshape(len(array), -1)
            for column in range(rows.shape[1]):
                name = key if rows.shape[1] == 1 else f"{key}[{column}]"
                values.setdefault(name, {})[learner] = rows[:, column]
    return values


def _describe(
    predictions: Mapping[str, Mapping[Learner, Prediction]],
    spreads: Mapping[str, PeopleSpread],
    contrasts: Sequence[Contrast],
) -> dict[str, Any]:
    """Returns the predictions as written to the file; numbers that are not finite are null."""
    numbers = {
        number: {
            learner.value: {
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
    """Replaces every number that is not finite by null, as JSON has no such numbers."""
    if isinstance(value, Mapping):
        return {name: _keep_finite(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_keep_finite(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
