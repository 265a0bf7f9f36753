"""What the shape of an object says of its inertia, whatever it is made of."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array


@dataclass(frozen=True)
class Geometry:
    """What shape alone says of an object's inertia: pi = Phi rho, with first-order uncertainty.

    Attributes:
        Phi: Inertia map, shape (10, M).
        Phi_errors: Change of Phi by one standard deviation of each uncertain measurement, shape (G, 10, M).
    """

    Phi: Array
    Phi_errors: Array

    def compute_parameters(self, rho: Array, errors: Array) -> Array:
        """Inertial parameters of N objects, shape (N, 10).

        Args:
            rho: Their densities, shape (N, M), [kg/m^3].
            errors: How far each uncertain measurement was off, in its standard deviations, shape (N, G).
        """
        parameters: Array = rho @ self.Phi.T
        if len(self.Phi_errors):
            parameters += np.einsum("ng,gpm,nm->np", errors, self.Phi_errors, rho, optimize=True)
        return parameters

    def compute_covariance(self, rho: Array) -> Array:
        """Covariance of pi from the uncertain geometry at densities rho, shape (10, 10)."""
        errors = self.Phi_errors @ rho  # (G, 10)
        return errors.T @ errors
