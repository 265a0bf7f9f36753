"""What is believed of one object, and what every learner offers that believes something of it.

A memory is a value: learning returns another one. Systems, simulations and choices know the Protocol ``Memory``
only; which learner an observer has is decided by the memory it starts with (``MaterialMemory``, one density for each
colour, or ``KindMemory``, one or more kinds for each colour).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.known_density import Density
from affordance.belief.likelihood import Likelihood
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour
from affordance.objects.geometry import Geometry
from affordance.objects.named_colour import MaterialLike
from affordance.objects.tool import Material

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


@runtime_checkable
class Memory(Protocol):
    """What an observer believes of materials and objects, and how it is updated."""

    @property
    def colours(self) -> tuple[Colour, ...]:
        """The colours met so far, in the order they were met."""

    @property
    def belief(self) -> DensityBelief:
        """Belief about the mean density of objects of each colour that were never seen before."""

    def density(self, material: MaterialLike, materials: Mapping[str, Material] | None = None) -> Density:
        """What is believed of a material that was met; see ``MaterialMemory.density``."""

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> Self:
        """Returns the memory extended by the prior for those colours that were never met."""

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> tuple[Self, int]:
        """Returns the memory, which has met a measured colour, and the place of what stands for it among the colours.

        Args:
            colour: As measured.
            colour_sd: Standard deviation of the measurement in each direction of CIELAB; 0 if it is exact.
            prior: What is believed of materials never met.
            lightness_sd: Standard deviation of a further error of its brightness, in units of L*.
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


@dataclass(frozen=True)
class ObjectBelief:
    """Belief about the object at hand.

    Attributes:
        memory: Beliefs about all materials, those of this object included.
        densities: Belief about this object's own densities, in the order of Phi's columns; there may be materials it
            is not made of, whose columns are zero.
        geometry: Phi and its uncertainty.
    """

    memory: Memory
    densities: DensityBelief
    geometry: Geometry

    def compute_parameters(self, rho: Array) -> Array:
        """Inertial parameters pi = Phi rho, shape (10,), or (N, 10) for N densities."""
        return rho @ self.geometry.Phi.T

    @cached_property
    def parameter_mean(self) -> Array:
        """Predictive mean of pi, shape (10,)."""
        return self.compute_parameters(self.densities.compute_mean())

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Samples of pi from its predictive distribution, geometry's error included, shape (num_samples, 10)."""
        rho = self.densities.draw_samples(rng, num_samples)
        errors = rng.standard_normal((num_samples, len(self.geometry.Phi_errors)))
        return self.geometry.compute_parameters(rho, errors)
