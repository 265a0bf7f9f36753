"""Lasting memory of a run's single observer: loads what it already knows, and stores what it feels."""

import uuid
from dataclasses import replace
from functools import partial
from pathlib import Path

from affordance.belief.material_memory import start_memory
from affordance.belief.memory_file import format_memory
from affordance.exceptions import BadValueError
from affordance.experiments.shared.observers import Setup
from affordance.extensions.memory.ledger import has_memory, open_memory
from affordance.extensions.memory.same_colours import SameColours
from affordance.extensions.memory.simulated_trial import describe_trial
from affordance.extensions.memory.summary import recall_with_objects
from affordance.files.constraints import SEEDS
from affordance.simulation.trial_record import TrialRecord


def remember_in(setup: Setup, place: Path | str, same_colours: SameColours = ()) -> Setup:
    """Returns the setup of one observer who begins with a lasting memory, and adds to it what it feels.

    The number of remembered trials is added to the seed, so that no measurement error is drawn twice; beyond the
    largest seed, counting starts again at 0. The settings must not be changed afterwards, because the learner's
    belief depends on them.

    Args:
        setup: Setup of a run of one observer.
        place: Path of the SQLite file. If it does not exist, the memory is empty, and the first trial creates it.
        same_colours: Pairs of colours that are the same but look different to two cameras. The second colour of each
            pair must be in the memory, and is read as the first.

    Raises:
        BadValueError: There are several observers, the file cannot be read, a record is invalid, or no stored part
            has the second colour of a pair.
    """
    if setup.observers != 1:
        problem = f"is {setup.observers}, must be 1 with a memory, which belongs to one observer"
        raise BadValueError("--repeats", "", problem)
    settings, place, trials = setup.settings, str(place), 0
    if not has_memory(place) and not same_colours:
        known = start_memory(settings.learner, setup.seed)
    else:
        with open_memory(place, create=False) as ledger:
            known = recall_with_objects(ledger, settings.learner, settings.prior, setup.seed, same_colours)
            trials = len(ledger)
    remember = partial(_append, place, uuid.uuid4().hex)  # so that observers of different runs are not confused
    seed = (setup.seed + trials) % (int(SEEDS.high) + 1)
    return replace(setup, known=format_memory(known), remember=remember, seed=seed)


def _append(place: str, run: str, record: TrialRecord) -> None:
    """Appends a trial if something was felt in it; raises a BadValueError if the file cannot be written."""
    if (evidence := describe_trial(record)) is not None:
        with open_memory(place) as ledger:
            ledger.append([evidence])
