"""Dependence of an object's inertia on its shape, for any material."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array


@dataclass(frozen=True)
class Geometry:
    """Inertia map of an object's shape: pi = Phi rho, with first-order uncertainty.

    Attributes:
        Phi: Inertia map, shape (10, M).
        Phi_errors: Change of Phi by one standard deviation of each uncertain measurement, shape (G, 10, M).
    """

    Phi: Array
    Phi_errors: Array

    def compute_parameters(self, rho: Array, errors: Array) -> Array:
        """Computes the inertial parameters of N objects, shape (N, 10).

        Args:
            rho: Densities, shape (N, M), [kg/m^3].
            errors: Errors of the uncertain measurements, in units of their standard deviations, shape (N, G).
        """
        parameters: Array = rho @ self.Phi.T
        if len(self.Phi_errors):
            parameters += np.einsum("ng,gpm,nm->np", errors, self.Phi_errors, rho, optimize=True)
        return parameters

    def compute_covariance(self, rho: Array) -> Array:
        """Computes the covariance of pi due to uncertain geometry at densities rho, (M,), shape (10, 10)."""
        errors = self.Phi_errors @ rho  # (G, 10)
        return errors.T @ errors
