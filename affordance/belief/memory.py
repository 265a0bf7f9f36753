"""What every learner offers: what it believes before an object is felt, what a trial teaches, what it remembers.

A memory is a value: learning returns another one. Systems, simulations and choices know this Protocol only; which
learner an observer has is decided by the memory it starts with (``MaterialMemory``, one density for each colour, or
``KindMemory``, one or more kinds for each colour).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, Self

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour

# Finds the likelihood of an object's densities, given what is believed of them before it is felt: the size of errors
# that grow with torque depends on it.
type FindLikelihood = Callable[[DensityBelief], Likelihood]


class Recollection[M](NamedTuple):
    """What is believed of an object that is seen.

    Attributes:
        memory: The memory, which has met all colours of the object.
        densities: Belief about the object's own densities.
        columns: For each part, which of these densities it has.
    """

    memory: M
    densities: DensityBelief
    columns: tuple[int, ...]


class Lesson[M](NamedTuple):
    """What a trial teaches.

    Attributes:
        memory: What is remembered after it.
        densities: Belief about the object's own densities after it.
        likelihood: Of these densities, as it was used.
    """

    memory: M
    densities: DensityBelief
    likelihood: Likelihood


class Memory(Protocol):
    """What an observer believes of materials and objects."""

    @property
    def colours(self) -> tuple[Colour, ...]:
        """The colours met so far, in the order they were met."""

    @property
    def belief(self) -> DensityBelief:
        """Belief about the mean density of objects of each colour that were never seen before."""

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> Self:
        """Returns the memory extended by the prior for those colours that were never met."""

    def recognise(self, colour: Colour, colour_sd: float, prior: Prior) -> tuple[Self, int]:
        """Returns the memory, which has met a measured colour, and the place of what stands for it among the colours.

        Args:
            colour: As measured.
            colour_sd: Standard deviation of the measurement in each direction of CIELAB; 0 if it is exact.
            prior: What is believed of materials never met.
        """

    def restrict_to(self, colours: Sequence[Colour]) -> Self:
        """Returns the memory with these colours only, all of which it has met, in their order."""

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> Recollection[Self]:
        """Recalls what objects like this one weighed.

        Args:
            appearance: What is seen of each part.
            prior: What is believed of materials never met.
        """

    def learn(self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float) -> Lesson[Self]:
        """Learns from a trial with the object recalled last.

        Args:
            densities: Belief about the object's own densities before the trial, from ``recall``.
            find_likelihood: Finds the likelihood of what was felt.
            deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].
        """
