"""Belief about a held or seen object."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.colour import Colour
from affordance.objects.inertia import Geometry


@dataclass(frozen=True)
class ObjectBelief:
    """Belief about a held or seen object: its densities and geometry, and the memory of materials."""

    memory: MaterialMemory
    densities: DensityBelief  # belief about M densities, in the order of Phi's columns
    geometry: Geometry
    colours: tuple[int, ...] = ()  # index of each density's colour in the memory

    def list_colours(self) -> list[Colour]:
        """Lists the colour of each material of the object, in the order of its densities."""
        return [self.memory.colours[colour] for colour in self.colours]

    def compute_parameters(self, rho: Array) -> Array:
        """Computes inertial parameters pi = Phi rho, (10,) or (N, 10), from densities, (M,) or (N, M)."""
        return rho @ self.geometry.Phi.T

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws inertial parameters pi, (num_samples, 10), with uncertain densities and geometry."""
        rho = self.densities.draw_samples(rng, num_samples)
        errors = rng.standard_normal((num_samples, len(self.geometry.Phi_errors)))
        return self.geometry.compute_parameters(rho, errors)
