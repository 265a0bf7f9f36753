"""Definition of an experiment: its functions and requirements."""

from collections.abc import Callable
from typing import Any, NamedTuple

from affordance.experiments.shared.observer_numbers import ObserverNumbers
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.results import Results
from affordance.settings import Settings


class Experiment(NamedTuple):
    """Functions and properties of an experiment. Its module defines one instance, EXPERIMENT.

    Attributes:
        run: Function that runs the experiment.
        read: Function that loads and checks the files of the experiment without a simulation.
        predict: Function that computes the measures of each observer for each learner, or None.
        observers: Default number of observers.
        needs: Tasks that the arm must be able to do. The experiment is skipped if the import of the arm reported that
            one of them is impossible.
        no_memory: Reason why a lasting memory cannot learn from the experiment, or empty.
        every_learner: True if observers with each learner are simulated, including a user's learner.
        settings: Class of the settings.
    """

    run: Callable[[Setup], Results]
    read: Callable[[Setup], Any] = lambda setup: None
    predict: Callable[[Setup], ObserverNumbers] | None = None
    observers: int = 200
    needs: tuple[str, ...] = ()
    no_memory: str = ""
    every_learner: bool = False
    settings: type[Settings] = Settings
