"""Catalogue of the experiments, and runs of several of them into one folder."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from affordance.simulations import com, hammer, reach, weight
from affordance.simulations.observers import Setup
from affordance.simulations.results import Results


class Experiment(NamedTuple):
    """Functions of an experiment: one that reads and checks its files, and one that runs it."""

    read: Callable[[Setup], Any]
    run: Callable[[Setup], Results]


EXPERIMENTS: Mapping[str, Experiment] = {
    "weight": Experiment(weight.read, weight.run),
    "com": Experiment(com.read, com.run),
    "reach": Experiment(reach.read, reach.run),
    "hammer": Experiment(hammer.read, hammer.run),
}
