"""Evidence from simulated trials, and observers with a lasting memory."""

import uuid
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from affordance.belief.material_memory import start_memory
from affordance.belief.memory_file import format_memory
from affordance.exceptions import BadValueError
from affordance.extensions.memory.ledger import has_memory, open_memory
from affordance.extensions.memory.trial_evidence import FELT_MODELS, TrialEvidence
from affordance.files.constraints import SEEDS
from affordance.plant.arm import name_robot
from affordance.plant.chain_plant import recognise_arm
from affordance.plant.load import load_arm
from affordance.simulation.trial_record import TrialRecord
from affordance.vision.prediction import measure_geometry

if TYPE_CHECKING:
    from affordance.experiments.shared.observers import Setup


def describe_trial(record: TrialRecord) -> TrialEvidence | None:
    """Builds the evidence of a simulated trial for a lasting memory.

    Returns None if there were no measurements or the noise model is user-defined.
    """
    percept = record.percept
    if percept is None or type(percept.noise) not in FELT_MODELS.values():
        return None
    num_parts = len(percept.features)
    return TrialEvidence(
        object_name=percept.object_name,
        parts=tuple(part.appearance for part in percept.features),
        geometry=measure_geometry(percept.features, range(num_parts), num_parts),
        model=percept.noise,
        features=percept.statistics.features,
        num_samples=percept.statistics.num_samples,
        num_joints=percept.num_joints,
        robot=name_robot(percept.arm),
        fingerprint=recognise_arm(load_arm(percept.arm)),
        log_evidence=record.log_evidence,
        p_value=record.p_value,
        source="simulated",
    )


def remember_in(setup: "Setup", place: Path | str) -> "Setup":
    """Returns the setup of an observer that starts with a lasting memory and adds new trials to it.

    The number of stored trials is added to the seed, modulo the number of seeds, so that no measurement error is
    drawn twice. Do not change the settings afterwards: the learner's belief depends on them.

    Args:
        setup: Setup of a run of one observer.
        place: Path of the SQLite file. If it does not exist, the memory is empty and the first trial creates the
            file.

    Raises:
        BadValueError: There are several observers, the file cannot be read, or a record is invalid.
    """
    if setup.observers != 1:
        problem = f"is {setup.observers}, must be 1 with a memory, which belongs to one observer"
        raise BadValueError("--repeats", "", problem)
    settings, place, trials = setup.settings, str(place), 0
    if not has_memory(place):
        known = start_memory(settings.learner, setup.seed)
    else:
        with open_memory(place, create=False) as ledger:
            known = ledger.recall(settings.learner, settings.prior, seed=setup.seed)
            trials = len(ledger)
    remember = partial(_append, place, uuid.uuid4().hex)  # distinguishes runs with equal seeds
    seed = (setup.seed + trials) % (int(SEEDS.high) + 1)
    return replace(setup, known=format_memory(known), remember=remember, seed=seed)


def _append(place: str, run: str, record: TrialRecord) -> None:
    """Appends a trial with measurements to a memory. A BadValueError is raised if the file cannot be written."""
    if (evidence := describe_trial(record)) is not None:
        with open_memory(place) as ledger:
            ledger.append([evidence])
