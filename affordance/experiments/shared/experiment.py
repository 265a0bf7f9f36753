"""Definition of an experiment: its functions and requirements."""

from collections.abc import Callable
from typing import Any, NamedTuple

from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.settings import Settings


class Experiment(NamedTuple):
    """Functions and properties of an experiment; its module defines one as EXPERIMENT.

    Attributes:
        run: Runs the experiment.
        read: Reads and checks its files without simulating anything.
        predict: Computes the numbers of each observer of every learner; None if the experiment cannot be predicted.
        observers: Default number of observers.
        needs: Tasks that the arm must be able to do. The experiment is left out if the import of the arm found that
            it cannot do one of them.
        no_memory: Reason why a lasting memory cannot learn from it; empty if it can.
        every_learner: Whether observers of every learner are simulated, a user's learner included.
        settings: Class of its settings.
    """

    run: Callable[[Setup], Results]
    read: Callable[[Setup], Any] = lambda setup: None
    predict: Callable[[Setup], ObserverNumbers] | None = None
    observers: int = 200
    needs: tuple[str, ...] = ()
    no_memory: str = ""
    every_learner: bool = False
    settings: type[Settings] = Settings
