"""What learners predict of people who have not done a protocol yet: the numbers of every simulated observer."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import joblib
import numpy as np

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.exceptions import BadValueError
from affordance.experiments.holding import HoldExperiment
from affordance.experiments.lifting import LiftExperiment
from affordance.experiments.protocol_runs import load_protocol_experiment
from affordance.experiments.shared.hold_measures import select_learner
from affordance.named_settings import NO_CHANGES, Changes
from affordance.protocols.measured import compute_of_observers
from affordance.settings import Settings


def predict_protocol(
    name: str,
    models: Path,
    settings: Settings,
    *,
    repeats: int,
    seed: int,
    jobs: int,
    changes: Changes = NO_CHANGES,
) -> tuple[dict[str, dict[Learner, Array]], dict[str, str]]:
    """Simulates the observers of a protocol with each of its learners, or with all there are if it names but one.

    Args:
        name: Of the protocol, or its path.
        models: The folder of models.
        settings: What all simulations share.
        repeats: Observers, at least 2.
        seed: Root of every random draw.
        jobs: Processes.
        changes: Settings by name, which come after those of the protocol.

    Returns: By number and learner what each observer did, (R,); a number that is a list is one number an entry. And
        what each number means, in words.

    Raises:
        BadValueError: The file is wrong, or the protocol is about choices, which every learner makes on a run of its
            own.
    """
    experiment = load_protocol_experiment(name, models, seed, settings, changes)
    if not isinstance(experiment, HoldExperiment | LiftExperiment):
        problem = "is a choice, must be a hold, a clamp, a reach or a look; run it with --learner for each learner"
        raise BadValueError(experiment.section, "blocks", problem)
    if len(experiment.learners) < 2:
        experiment = replace(experiment, learners=tuple(Learner))
    run = partial(experiment.run_observer, None, None)
    rows = joblib.Parallel(n_jobs=min(jobs, repeats))(joblib.delayed(run)(repeat) for repeat in range(repeats))
    arrays = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
    if isinstance(experiment, LiftExperiment):
        found = experiment.compute_of_observers(arrays)
    else:
        found = {
            learner: compute_of_observers(
                experiment.numbers, experiment.measure(select_learner(arrays, learner, place))
            )
            for place, learner in enumerate(experiment.learners)
        }
    meanings = {key: entry.meaning for key, entry in experiment.numbers.items()}
    return sort_by_number(found, experiment.learners), meanings


def sort_by_number(
    found: Mapping[Learner, Mapping[str, Array]], learners: Sequence[Learner]
) -> dict[str, dict[Learner, Array]]:
    """Numbers of observers by number and learner; those with several entries as one number an entry."""
    values: dict[str, dict[Learner, Array]] = {}
    for learner in learners:
        for key, array in found[learner].items():
            rows = np.asarray(array, dtype=float).reshape(len(array), -1)
            for column in range(rows.shape[1]):
                name = key if rows.shape[1] == 1 else f"{key}[{column}]"
                values.setdefault(name, {})[learner] = rows[:, column]
    return values
