"""What is believed of one object: its densities, and what they say of its inertia by its geometry."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.memory import Memory
from affordance.objects.geometry import Geometry


@dataclass(frozen=True)
class ObjectBelief:
    """What is believed of the object at hand.

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
