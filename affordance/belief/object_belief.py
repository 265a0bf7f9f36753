"""Belief about the object at hand: its densities and geometry, and the memory of materials."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.colour import Colour
from affordance.objects.inertia import Geometry


@dataclass(frozen=True)
class ObjectBelief:
    """Belief about the object at hand: its densities and geometry, and the memory of materials.

    Densities are in the order of Phi's columns; ``colours`` are the indices of their colours in the memory.
    """

    memory: MaterialMemory
    densities: DensityBelief
    geometry: Geometry
    colours: tuple[int, ...] = ()

    def list_colours(self) -> list[Colour]:
        """Lists the colour of each material of the object, in the order of its densities."""
        return [self.memory.colours[colour] for colour in self.colours]

    def compute_parameters(self, rho: Array) -> Array:
        """Computes the inertial parameters pi = Phi rho, shape (10,).

        For rho of shape (N, M) the result is (N, 10).
        """
        return rho @ self.geometry.Phi.T

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws parameters pi from the predictive distribution, (num_samples, 10).

        Parameters include errors of geometry.
        """
        rho = self.densities.draw_samples(rng, num_samples)
        errors = rng.standard_normal((num_samples, len(self.geometry.Phi_errors)))
        return self.geometry.compute_parameters(rho, errors)
