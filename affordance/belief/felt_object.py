"""Things that were lifted, the object at hand, and an object with its likelihoods."""

from typing import NamedTuple

import numpy as np

from affordance.belief.likelihood import Likelihood
from affordance.belief.prior import Prior
from affordance.belief.rows import Seen
from affordance.objects.appearance import Appearance
from affordance.objects.colour import Colour


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


class FeltObject(NamedTuple):
    """Object that was held, with the likelihoods of its densities."""

    colours: tuple[Colour, ...]  # its m colours
    own: Likelihood  # likelihood of its own densities, of size m in the order of the colours
    shared: Likelihood  # likelihood of its materials' means, which the memory has learned, in the same order
    appearance: Appearance = ()  # appearance, with these colours

    @classmethod
    def of(
        cls, colours: tuple[Colour, ...], own: Likelihood | None, prior: Prior, appearance: Appearance
    ) -> "FeltObject | None":
        """Builds the object from the likelihood of its own densities; returns None if that is None."""
        if own is None:
            return None
        return cls(colours, own, own.marginalise_deviation(prior.deviation), appearance)
