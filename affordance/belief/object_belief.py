"""Belief about one object: its densities, and through its geometry its inertia."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.colour import Colour
from affordance.objects.geometry import Geometry


class Memory(Protocol):
    """Belief about the densities of all materials, by colour, and how it is updated."""

    @property
    def colours(self) -> tuple[Colour, ...]:
        """The colours of the materials, in the order of their densities."""

    @property
    def belief(self) -> DensityBelief:
        """Belief about the mean density of each."""

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> Self:
        """Returns the memory extended by the prior for those colours that it does not have."""

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> tuple[Self, int]:
        """Returns the memory with a measured colour in it, and the index of the material that it stands for.

        Args:
            colour: As measured.
            colour_sd: Standard deviation of the measurement in each direction of CIELAB; 0 if it is exact.
            prior: What is believed of a material never met.
            lightness_sd: Standard deviation of a further error of its brightness, in units of L*.
        """

    def condition(self, likelihood: Likelihood, deviation_sd: float) -> Self:
        """Returns the memory after a trial.

        Args:
            likelihood: Of the object's own densities, in the order of the colours.
            deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].
        """

    def restrict_to(self, colours: Sequence[Colour]) -> Self:
        """Returns the memory of some of its colours."""


@dataclass(frozen=True)
class ObjectBelief:
    """Belief about the object at hand.

    Attributes:
        memory: Beliefs about all materials, those of this object included.
        densities: Belief about this object's own densities, in the order of memory.colours; materials it is not
            made of stand there too, and have zero columns in Phi.
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
