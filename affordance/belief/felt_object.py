"""Records of lifted objects, and of the object that will be lifted next."""

from typing import NamedTuple

import numpy as np

from affordance.belief.rows import Seen
from affordance.objects.appearance import Appearance


class Thing(NamedTuple):
    """Lifted object."""

    appearance: Appearance  # appearance, with colours from the memory in place of the measured colours
    colours: tuple[int, ...]  # indices of its m colours


class AtHand(NamedTuple):
    """Object that was recalled last and will be lifted next."""

    thing: Thing
    number: int  # number of the object; the next free number if it was never lifted

    @property
    def seen(self) -> Seen:
        """Object in the format that learners use."""
        return Seen(self.thing.colours, np.array([self.number]))
