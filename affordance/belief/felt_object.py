"""What was felt of one thing, for choices that doubt whether it is what it looks like."""

from typing import NamedTuple

from affordance.belief.density_belief import Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.appearance import Appearance
from affordance.objects.colour import Colour


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
        return cls(colours, own, own.marginalise_deviation(prior.deviation_sd), appearance)
