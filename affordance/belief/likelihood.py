"""Quadratic log likelihoods of densities and of a body's ten inertial parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

# Eigenvalues of a precision below this fraction of the largest eigenvalue are treated as zero.
SEEN = 1e-12


class Likelihood(NamedTuple):
    """Quadratic log likelihood of M densities rho.

    The log likelihood is log p(data | rho) = -rho^T P rho / 2 + q^T rho + log_constant. All arrays may have leading
    dimensions, for example for observers.
    """

    precision: Array  # P, shape (..., M, M)
    information_vector: Array  # q, shape (..., M)
    log_constant: float | Array  # log probability density of the data if all densities are zero, shape (...,)
    # Log probability density of error-free data, shape (...,): the largest possible value, for p-values.
    log_peak: float | Array = np.nan
    num_values: int = 0  # number of measured values

    def take(self, rows: Any) -> "Likelihood":
        """Returns the entries at one or several indices along the first dimension."""
        shape = self.information_vector.shape[:-1]
        log_constant, log_peak = (np.broadcast_to(each, shape)[rows] for each in self[2:4])
        P, q = self.precision[rows], self.information_vector[rows]
        return Likelihood(P, q, log_constant, log_peak, self.num_values)

    def put(self, rows: NDArray[np.intp], other: "Likelihood") -> "Likelihood":
        """Returns a copy with some rows of the first dimension replaced."""
        P, q, log_constant, log_peak = (np.array(each) for each in self[:4])
        for array, new in zip((P, q, log_constant, log_peak), other[:4], strict=True):
            array[rows] = new
        return Likelihood(P, q, log_constant, log_peak, other.num_values)

    def select(self, columns: Sequence[int]) -> "Likelihood":
        """Selects densities. The data must not depend on the other densities."""
        chosen = list(columns)
        P, q = self.precision[(..., *np.ix_(chosen, chosen))], self.information_vector[..., chosen]
        return self._replace(precision=P, information_vector=q)

    def embed(self, columns: "Sequence[int] | NDArray[np.intp]", size: int) -> "Likelihood":
        """Extends the likelihood to more densities, on which the data do not depend.

        Args:
            columns: New indices of the present densities, (..., M).
            size: New number of densities.
        """
        S = (np.asarray(columns, dtype=np.intp)[..., None] == np.arange(size)).astype(float)
        St = np.swapaxes(S, -1, -2)
        information_vector = np.matvec(St, self.information_vector)
        return self._replace(precision=St @ self.precision @ S, information_vector=information_vector)


@dataclass(frozen=True)
class Quadratic:
    """Quadratic log likelihood of inertial parameters, -pi^T H pi / 2 + b^T pi + constant."""

    precision: Array  # H, shape (10, 10); may be singular
    information: Array  # b, shape (10,)

    def widen(self, covariance: Array) -> "Quadratic":
        """Adds independent parameter errors with a covariance of shape (10, 10)."""
        A = np.linalg.inv(np.eye(len(self.information)) + self.precision @ covariance)
        precision = A @ self.precision
        return Quadratic(0.5 * (precision + precision.T), A @ self.information)

    def restrict(self, Phi: Array) -> Likelihood:
        """Converts the quadratic to densities rho of a body pi = Phi rho, with Phi of shape (10, M).

        The constant makes the log likelihood zero at the best-fitting inertial parameters.
        """
        H, b = self.precision, self.information
        values, vectors = np.linalg.eigh(H)
        seen = values > SEEN * values[-1]
        distance = float(((vectors.T @ b)[seen] ** 2 / values[seen]).sum())
        return Likelihood(Phi.T @ H @ Phi, Phi.T @ b, -0.5 * distance, 0.0, int(seen.sum()))

    def change_frame(self, to_here: Array) -> "Quadratic":
        """Converts the quadratic to parameters in another frame.

        Args:
            to_here: Matrix that converts parameters in the other frame to parameters in the present frame, (10, 10).
        """
        precision = to_here.T @ self.precision @ to_here
        return Quadratic(0.5 * (precision + precision.T), to_here.T @ self.information)

    def find_load(self, pi: Array, covariance: Array) -> Array:
        """Computes the most probable inertial parameters of a load, (10,), from a normal prior.

        Args:
            pi: Prior mean, (10,).
            covariance: Prior covariance, (10, 10).
        """
        missing = self.information - self.precision @ pi
        load: Array = pi + covariance @ np.linalg.solve(np.eye(len(pi)) + self.precision @ covariance, missing)
        return load

    def evaluate(self, pi: Array) -> Array:
        """Computes the log likelihood without its constant, (N,), at N points, (N, 10)."""
        value: Array = pi @ self.information - 0.5 * np.einsum("ni,ij,nj->n", pi, self.precision, pi, optimize=True)
        return value

    def about(self, origin: Array) -> "Quadratic":
        """Converts the quadratic to a function of pi - origin, with an origin of shape (10,)."""
        return Quadratic(self.precision, self.information - self.precision @ origin)
