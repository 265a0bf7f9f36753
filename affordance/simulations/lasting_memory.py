"""Lasting memory of the one observer of a run: what it begins with, and where what it feels is added."""

import uuid
from dataclasses import dataclass, field

from affordance.belief.memory_file import format_memory, parse_memory
from affordance.belief.learner import Learner
from affordance.belief.material_memory import MaterialMemory, start_memory
from affordance.memory.ledger import has_memory, open_memory
from affordance.memory.same_colours import SameColours
from affordance.memory.simulated_trial import describe_trial
from affordance.memory.summary import recall_with_objects
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord


@dataclass(frozen=True)
class LastingMemory:
    """Memory in a file, as it was when a run began.

    Attributes:
        place: Path of the SQLite file; it is made by the first trial.
        learner: Learner of the one observer.
        known: What the learner believed when the run began, as JSON text.
        trials: Number of trials when the run began.
        run: Random text by which observers that another run kept are not taken for this one's.
    """

    place: str
    learner: Learner
    known: str
    trials: int
    run: str = field(default_factory=lambda: uuid.uuid4().hex)

    def recall(self) -> MaterialMemory:
        """Returns what the learner believed when the run began."""
        return parse_memory(self.known, self.learner)

    def append(self, record: TrialRecord) -> None:
        """Appends a trial in which something was felt; a file that cannot be written raises a BadValueError."""
        if (evidence := describe_trial(record)) is not None:
            with open_memory(self.place) as ledger:
                ledger.append([evidence])


def recall_lasting(place: str, settings: Settings, seed: int, same_colours: SameColours = ()) -> LastingMemory:
    """Recalls a lasting memory for a run; one that does not exist yet knows nothing.

    Args:
        place: Path of the SQLite file.
        settings: Settings with the learner and its prior.
        seed: Seed of the learner's random draws, if it makes any.
        same_colours: Pairs of colours that two cameras see differently; of each, the second, which must be in the
            memory, is read as the first.

    Raises:
        BadValueError: The file cannot be read, a record is invalid, or no part has a pair's second colour.
    """
    if not has_memory(place) and not same_colours:
        return LastingMemory(place, settings.learner, format_memory(start_memory(settings.learner, seed)), 0)
    with open_memory(place, create=False) as ledger:
        known = recall_with_objects(ledger, settings.learner, settings.prior, seed, same_colours)
        return LastingMemory(place, settings.learner, format_memory(known), len(ledger))
