"""Things that were lifted, and the object at hand."""

from typing import NamedTuple

import numpy as np

from affordance.belief.rows import Seen
from affordance.objects.appearance import Appearance


class Thing(NamedTuple):
    """Thing that was lifted."""

    appearance: Appearance  # appearance, with the colours as stored in the memory
    colours: tuple[int, ...]  # indices of its m colours


class AtHand(NamedTuple):
    """Object that was recalled last, and its number; an object that was never lifted has the next free number."""

    thing: Thing
    number: int

    @property
    def seen(self) -> Seen:
        """The object as a learner sees it."""
        return Seen(self.thing.colours, np.array([self.number]))
