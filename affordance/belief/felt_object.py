"""Lifted objects, and the object at hand."""

from typing import NamedTuple

import numpy as np

from affordance.belief.rows import Seen
from affordance.objects.appearance import Appearance


class Thing(NamedTuple):
    """Object that was lifted."""

    appearance: Appearance  # appearance, with the colours as stored in the memory
    colours: tuple[int, ...]  # indices of its m colours


class AtHand(NamedTuple):
    """Object that was recalled last, with its number. An object that was never lifted has the next free number."""

    thing: Thing
    number: int

    @property
    def seen(self) -> Seen:
        """Object in the form that a learner needs."""
        return Seen(self.thing.colours, np.array([self.number]))
