"""Normal distributions of one vector, evaluated together."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from affordance.arrays import Array


@dataclass(frozen=True)
class Normals:
    """K normal distributions of a vector of D numbers.

    Attributes:
        means: Means, shape (K, D).
        covariances: Covariances, shape (K, D, D).
    """

    means: Array
    covariances: Array

    def __len__(self) -> int:
        return len(self.means)

    @cached_property
    def roots(self) -> Array:
        """Lower triangular roots L of the covariances, L L^T, shape (K, D, D)."""
        return np.linalg.cholesky(self.covariances)

    @cached_property
    def precisions(self) -> Array:
        """Inverses of the covariances, shape (K, D, D)."""
        inverse = np.linalg.inv(self.covariances)
        precisions: Array = 0.5 * (inverse + inverse.swapaxes(-1, -2))
        return precisions

    @cached_property
    def log_scales(self) -> Array:
        """Logarithms of the densities at the means without powers of 2 pi, shape (K,)."""
        scales: Array = -np.log(np.diagonal(self.roots, axis1=1, axis2=2)).sum(axis=1)
        return scales

    @cached_property
    def _whitening(self) -> tuple[Array, Array]:
        """Inverse roots of all distributions side by side, (D, K D), and the means in their units, (K D,)."""
        num, size = self.means.shape
        inverse = np.linalg.inv(self.roots)
        return inverse.reshape(num * size, size).T, (inverse @ self.means[..., None]).ravel()

    def measure_squares(self, points: Array) -> Array:
        """Computes squared distances from the means in standard deviations, points of shape (N, D), result (N, K)."""
        num, size = self.means.shape
        whitening, origin = self._whitening
        away = points @ whitening - origin
        away = away.reshape(len(points), num, size)
        squares: Array = np.einsum("nkd,nkd->nk", away, away)
        return squares


def add_logs(logs: Array) -> Array:
    """Computes the logarithms of sums of exponentials over K terms, shape (N, K), several times faster than NumPy."""
    most = logs.max(axis=1)
    total: Array = most + np.log(np.exp(logs - most[:, None]).sum(axis=1))
    return total
