"""Catalogue of the experiments, and runs of several of them into one folder."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from affordance.simulations import com, hammer, linear, next_lift, reach, spoilt_family, two_families, vision, weight
from affordance.simulations.observers import Setup
from affordance.simulations.results import Results


class Experiment(NamedTuple):
    """Functions of an experiment: one that reads and checks its files, and one that runs it."""

    read: Callable[[Setup], Any]
    run: Callable[[Setup], Results]


def nothing(setup): ...


EXPERIMENTS: Mapping[str, Experiment] = {
    "weight": Experiment(weight.read, weight.run),
    "com": Experiment(com.read, com.run),
    "reach": Experiment(reach.read, reach.run),
    "hammer": Experiment(hammer.read, hammer.run),
    "linear_plus": Experiment(nothing, partial(linear.run, "linear_plus")),
    "linear_plus_plus": Experiment(nothing, partial(linear.run, "linear_plus_plus")),
    "vision": Experiment(vision.read, vision.run),
    "next_lift": Experiment(next_lift.read, next_lift.run),
    "spoilt_family": Experiment(nothing, spoilt_family.run),
    "two_families": Experiment(nothing, two_families.run),
}
