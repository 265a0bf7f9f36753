"""Numbers that separate random draws of different kinds: each is part of a seed, with root, observer and trial.

They exceed the numbers of observers or trials that take the same place in other seeds. None is 0: a trailing 0 adds
nothing to a NumPy seed of up to four numbers.
"""

import enum
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from affordance.arrays import Array


@enum.unique
class Stream(enum.IntEnum):
    """Kind of a random draw."""

    TEST = 10**5  # in place of the trial: holds that test learning (com)
    ORDER = 10**6  # the order in which an observer is given objects
    PAPER = 10**6 + 1  # choices by the paper's rule
    BAYES = 10**6 + 2  # choices by least expected work
    PRIOR = 10**6 + 3  # choices before any experience
    LIGHT_ENDS = 10**6 + 5  # choices that are compared with the order of the densities (hammer)
    SHOWN = 10**6 + 6  # pictures of objects for the report
    OBSERVATION = 10**6 + 7  # observation of an object to choose, with its name
    ACCELERATION = 10**6 + 14  # errors of measured accelerations, with the seed of a trial
    LIFT_ORDER = 10**6 + 21  # the order in which an observer lifts objects (lifts in closed form)
    LIFT = 10**6 + 22  # measurement errors in these lifts
    CHOSEN = 10**6 + 24  # samples by which observers choose what they hold next
    KINDS = 10**6 + 23  # hypotheses about kinds that are drawn
    PERSON = 10**6 + 26  # how a participant differs from others (lifts in closed form)
    REPEAT = 10**6 + 25  # after the place of a participant: repeats after the first, with their number


class ObserverDraws:
    """Random numbers of several observers, each from a generator of its own: what one draws depends on no other."""

    def __init__(self, seeds: Sequence[tuple[int, ...]]) -> None:
        """Stores the seed of each observer's generator."""
        self._seeds = seeds

    def random(self, size: tuple[int, ...], /) -> Array:
        """Draws uniform numbers in [0, 1); the first dimension is that of observers."""
        return np.array([each.random(size[1:]) for each in self._generators])

    def standard_normal(self, size: tuple[int, ...], /) -> Array:
        """Draws standard normal numbers; the first dimension is that of observers."""
        return np.array([each.standard_normal(size[1:]) for each in self._generators])

    @cached_property
    def _generators(self) -> list[np.random.Generator]:
        """Generators, built when they are needed, which takes longer than most lifts."""
        return [np.random.default_rng(seed) for seed in self._seeds]
