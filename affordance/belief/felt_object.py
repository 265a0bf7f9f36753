"""Things that were lifted, the one at hand, and what was felt of one."""

from typing import NamedTuple

import numpy as np

from affordance.belief.likelihood import Likelihood
from affordance.belief.prior import Prior
from affordance.belief.rows import Seen
from affordance.objects.appearance import Appearance
from affordance.objects.colour import Colour


class Thing(NamedTuple):
    """Thing that was lifted."""

    appearance: Appearance  # with the colours of the memory
    colours: tuple[int, ...]  # indices of its m colours


class AtHand(NamedTuple):
    """Object that was recalled last: as a thing, and its number, which is the next one if it was never lifted."""

    thing: Thing
    number: int

    @property
    def seen(self) -> Seen:
        """The object as a learner sees it."""
        return Seen(self.thing.colours, np.array([self.number]))


class FeltObject(NamedTuple):
    """Object that was held, with the likelihoods of the densities that were felt."""

    colours: tuple[Colour, ...]  # m of them
    own: Likelihood  # of its own densities, of size m in the order of the colours
    shared: Likelihood  # of its materials' means, which the memory has learned, in the same order
    appearance: Appearance = ()  # with these colours

    @classmethod
    def of(
        cls, colours: tuple[Colour, ...], own: Likelihood | None, prior: Prior, appearance: Appearance
    ) -> "FeltObject | None":
        """Returns the object with its own likelihood; None if nothing was felt."""
        if own is None:
            return None
        return cls(colours, own, own.marginalise_deviation(prior.deviation), appearance)
