"""Quadratic log likelihoods of densities, and of the ten inertial parameters of a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

# Eigenvalues of a precision below this share of the largest one carry no information.
SEEN = 1e-12


class Likelihood(NamedTuple):
    """Quadratic log likelihood of M densities rho.

    The log likelihood is log p(data | rho) = -rho^T P rho / 2 + q^T rho + log_constant.

    All arrays may have leading dimensions, for example one for observers.
    """

    precision: Array  # P, shape (..., M, M)
    information_vector: Array  # q, shape (..., M)
    log_constant: float | Array  # log probability density of the data if all densities are zero, shape (...,)
    # Log probability density of error-free data, the largest possible value, for p-values, shape (...,).
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
        """Selects densities, for data that do not depend on the others."""
        chosen = list(columns)
        P, q = self.precision[(..., *np.ix_(chosen, chosen))], self.information_vector[..., chosen]
        return self._replace(precision=P, information_vector=q)

    def embed(self, columns: "Sequence[int] | NDArray[np.intp]", size: int) -> "Likelihood":
        """Extends the likelihood to ``size`` densities.

        ``columns``, (..., M), are the indices of the present densities.
        """
        S = (np.asarray(columns, dtype=np.intp)[..., None] == np.arange(size)).astype(float)
        St = np.swapaxes(S, -1, -2)
        information_vector = np.matvec(St, self.information_vector)
        return self._replace(precision=St @ self.precision @ S, information_vector=information_vector)


@dataclass(frozen=True)
class Quadratic:
    """Quadratic log likelihood of parameters, -pi^T H pi / 2 + b^T pi + constant."""

    precision: Array  # H, shape (10, 10); may be singular
    information: Array  # b, shape (10,)

    def widen(self, covariance: Array) -> "Quadratic":
        """Returns the quadratic with additional parameter errors of covariance (10, 10)."""
        A = np.linalg.inv(np.eye(len(self.information)) + self.precision @ covariance)
        precision = A @ self.precision
        return Quadratic(0.5 * (precision + precision.T), A @ self.information)

    def restrict(self, Phi: Array) -> Likelihood:
        """Restricts the quadratic to bodies pi = Phi rho with densities rho, Phi of shape (10, M).

        The constant is chosen so that the log likelihood is zero at the best-fitting parameters.
        """
        H, b = self.precision, self.information
        values, vectors = np.linalg.eigh(H)
        seen = values > SEEN * values[-1]
        distance = float(((vectors.T @ b)[seen] ** 2 / values[seen]).sum())
        return Likelihood(Phi.T @ H @ Phi, Phi.T @ b, -0.5 * distance, 0.0, int(seen.sum()))

    def change_frame(self, to_here: Array) -> "Quadratic":
        """Returns the quadratic in another frame.

        The map ``to_here``, (10, 10), converts parameters of that frame to this one.
        """
        precision = to_here.T @ self.precision @ to_here
        return Quadratic(0.5 * (precision + precision.T), to_here.T @ self.information)

    def find_load(self, pi: Array, covariance: Array) -> Array:
        """Computes the most probable load, (10,), given a body and its covariance.

        The body's parameters are (10,), the covariance of its error (10, 10).
        """
        missing = self.information - self.precision @ pi
        load: Array = pi + covariance @ np.linalg.solve(np.eye(len(pi)) + self.precision @ covariance, missing)
        return load

    def evaluate(self, pi: Array) -> Array:
        """Computes the log likelihood at N points, (N, 10), without its constant; shape (N,)."""
        value: Array = pi @ self.information - 0.5 * np.einsum("ni,ij,nj->n", pi, self.precision, pi, optimize=True)
        return value

    def about(self, origin: Array) -> "Quadratic":
        """Returns the quadratic as a function of pi - origin, with an origin of shape (10,)."""
        return Quadratic(self.precision, self.information - self.precision @ origin)
