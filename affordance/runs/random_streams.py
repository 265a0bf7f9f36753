"""Constants in random seeds, which make draws for different purposes independent.

A seed consists of root, observer, trial and such a constant. Most constants are larger than the numbers of observers
or trials that can be in the same position of other seeds. Smaller constants are used only after a trial's, sample's
or lift's own seed, where nothing else is counted. Only one constant is 0, because a trailing 0 does not change a
NumPy seed of up to four numbers. This is harmless, because no other draw uses a trial's seed alone.
"""

import enum
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from affordance.arrays import Array


class Stream(enum.IntEnum):
    """Purpose of a random draw."""

    SEEING = 0  # after the seed of a trial: errors of the features
    SENSING = 1  # after the seed of a trial: errors of measured torques and accelerations
    FAULT = 1  # after the number of a sample: faults of the torque sensor
    LIFT_DENSITY = 1  # after the number of a lift in closed form: density that the participant expects
    CONTROL = 2  # after the seed of a trial: density that the controller draws
    PUSH = 2  # after the number of a lift in closed form: error of the push
    TEST = 10**5  # instead of the trial: holds that test learning (com)
    ORDER = 10**6  # order in which an observer receives objects
    PAPER = 10**6 + 1  # choices with the paper's rule
    BAYES = 10**6 + 2  # choices with the least expected work
    PROBABILITY = 10**6 + 4  # probabilities under the paper's rule
    PRIOR = 10**6 + 3  # choices before any experience
    LIGHT_ENDS = 10**6 + 5  # choices that are compared with the order of densities (hammer)
    SHOWN = 10**6 + 6  # pictures of objects in the report
    OBSERVATION = 10**6 + 7  # observation of an object among which observers choose, together with its name
    ACCELERATION = 10**6 + 14  # errors of measured accelerations, together with the seed of a trial
    LIFT_ORDER = 10**6 + 21  # order in which an observer lifts objects (lifts in closed form)
    LIFT = 10**6 + 22  # measurement errors in these lifts
    CHOSEN = 10**6 + 24  # samples with which observers choose the next object to hold
    KINDS = 10**6 + 23  # sampled hypotheses about kinds
    PERSON = 10**6 + 26  # differences between participants (lifts in closed form)
    REPEAT = 10**6 + 25  # after a participant's position: the number of a repeat after the first


class ObserverDraws:
    """Random numbers of several observers, each with an independent generator."""

    def __init__(self, seeds: Sequence[tuple[int, ...]]) -> None:
        """Stores the seed of each observer's generator."""
        self._seeds = seeds

    def random(self, size: tuple[int, ...], /) -> Array:
        """Draws uniform numbers in [0, 1). The first dimension of the array is the observer."""
        return np.array([each.random(size[1:]) for each in self._generators])

    def standard_normal(self, size: tuple[int, ...], /) -> Array:
        """Draws standard normal numbers. The first dimension of the array is the observer."""
        return np.array([each.standard_normal(size[1:]) for each in self._generators])

    @cached_property
    def _generators(self) -> list[np.random.Generator]:
        """Generators, created only when needed, because this takes longer than most lifts."""
        return [np.random.default_rng(seed) for seed in self._seeds]
