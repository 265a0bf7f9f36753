"""Lasting memory of the one observer of a run: what it begins with, and where what it feels is added."""

import uuid
from dataclasses import replace
from functools import partial
from pathlib import Path

from affordance.belief.kind_memory import start_memory
from affordance.belief.memory_file import format_memory
from affordance.exceptions import BadValueError
from affordance.experiments.observers import Setup
from affordance.files.constraints import SEEDS
from affordance.memory.ledger import has_memory, open_memory
from affordance.memory.same_colours import SameColours
from affordance.memory.simulated_trial import describe_trial
from affordance.memory.summary import recall_with_objects
from affordance.simulation.trial_record import TrialRecord


def remember_in(setup: Setup, place: Path | str, same_colours: SameColours = ()) -> Setup:
    """Returns the setup of one observer who begins with a lasting memory, and adds to it what it feels.

    The number of remembered trials is added to the seed, past the largest from 0, so that no error of measurement is
    drawn again. Settings must not be changed afterwards, as the learner's belief depends on them.

    Args:
        setup: Setup of a run of one observer.
        place: Path of the SQLite file; one that does not exist yet knows nothing, and is made by the first trial.
        same_colours: Pairs of colours that two cameras see differently; of each, the second, which must be in the
            memory, is read as the first.

    Raises:
        BadValueError: There are several observers, the file cannot be read, a record is invalid, or no part has a
            pair's second colour.
    """
    if setup.observers != 1:
        problem = f"is {setup.observers}, must be 1 with a memory, which is of one observer"
        raise BadValueError("--repeats", "", problem)
    settings, place, trials = setup.settings, str(place), 0
    if not has_memory(place) and not same_colours:
        known = start_memory(settings.learner, setup.seed)
    else:
        with open_memory(place, create=False) as ledger:
            known = recall_with_objects(ledger, settings.learner, settings.prior, setup.seed, same_colours)
            trials = len(ledger)
    remember = partial(
        _append, place, uuid.uuid4().hex
    )  # so that observers of another run are not taken for this one's
    seed = (setup.seed + trials) % (int(SEEDS.high) + 1)
    return replace(setup, known=format_memory(known), remember=remember, seed=seed)


def _append(place: str, run: str, record: TrialRecord) -> None:
    """Appends a trial in which something was felt; a file that cannot be written raises a BadValueError."""
    if (evidence := describe_trial(record)) is not None:
        with open_memory(place) as ledger:
            ledger.append([evidence])
