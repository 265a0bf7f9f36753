"""Quadratic log likelihoods: of densities, and of the ten inertial parameters of a body."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

# Share of the largest eigenvalue of a precision below which eigenvalues carry no information.
SEEN = 1e-12


class Likelihood(NamedTuple):
    """Log likelihood log p(data | rho) = -rho^T P rho / 2 + q^T rho + log_constant of M densities rho.

    All arrays may have leading dimensions, as one for observers.
    """

    precision: Array  # P, shape (..., M, M)
    information_vector: Array  # q, shape (..., M)
    log_constant: float | Array  # log probability density of the data if all densities are zero, shape (...,)
    # Log probability density of data without error, the largest possible, for p-values, shape (...,).
    log_peak: float | Array = np.nan
    num_values: int = 0  # that were measured

    @classmethod
    def stack(cls, likelihoods: "Sequence[Likelihood]") -> "Likelihood":
        """Stacks likelihoods along a new first dimension; each is of as many values as the first."""
        P, q, log_constant, log_peak = (
            np.array(each) for each in zip(*(one[:4] for one in likelihoods), strict=True)
        )
        return cls(P, q, log_constant, log_peak, likelihoods[0].num_values)

    def take(self, rows: Any) -> "Likelihood":
        """Returns the entries of an index, or of several, along the first dimension."""
        shape = self.information_vector.shape[:-1]
        log_constant, log_peak = (np.broadcast_to(each, shape)[rows] for each in self[2:4])
        P, q = self.precision[rows], self.information_vector[rows]
        return Likelihood(P, q, log_constant, log_peak, self.num_values)

    def put(self, rows: NDArray[np.intp], other: "Likelihood") -> "Likelihood":
        """Returns the likelihoods with others in some rows of the first dimension."""
        P, q, log_constant, log_peak = (np.array(each) for each in self[:4])
        for array, new in zip((P, q, log_constant, log_peak), other[:4], strict=True):
            array[rows] = new
        return Likelihood(P, q, log_constant, log_peak, other.num_values)

    def select(self, columns: Sequence[int]) -> "Likelihood":
        """Returns the likelihood of some of the densities, where the others do not matter."""
        chosen = list(columns)
        P, q = self.precision[(..., *np.ix_(chosen, chosen))], self.information_vector[..., chosen]
        return self._replace(precision=P, information_vector=q)

    def embed(self, columns: "Sequence[int] | NDArray[np.intp]", size: int) -> "Likelihood":
        """Returns the likelihood of ``size`` densities, of which ``columns``, (..., M), are these."""
        S = (np.asarray(columns, dtype=np.intp)[..., None] == np.arange(size)).astype(float)
        St = np.swapaxes(S, -1, -2)
        information_vector = np.matvec(St, self.information_vector)
        return self._replace(precision=St @ self.precision @ S, information_vector=information_vector)

    def add(self, other: "Likelihood") -> "Likelihood":
        """Returns the likelihood of both data."""
        return Likelihood(
            self.precision + other.precision,
            self.information_vector + other.information_vector,
            self.log_constant + other.log_constant,
            self.log_peak + other.log_peak,
            self.num_values + other.num_values,
        )

    def estimate_densities(self) -> Array:
        """Estimates the densities from these data alone, (..., M), [kg/m^3].

        The estimate is the most likely one where the data determine each density. Where they do not, as with a torque
        that shows a weighted sum of two densities, it is as near as possible to a density common to all parts: the
        posterior mean under N(r, r'^2) for each, with r the common density that fits best and r' the root mean square
        of what the data tell of it. An SD as large as the density is the least informative one of a positive density
        that is known by its mean. The estimate depends on nothing but the summed data, so neither on their order nor
        on a belief, and is multiplied by a factor if all densities are.
        """
        P, q = self.precision, self.information_vector
        largest = np.trace(P, axis1=-2, axis2=-1)
        # A weighted sum that vanishes for equal densities tells nothing of a common density.
        common = np.maximum(P.sum(axis=(-2, -1)), np.maximum(SEEN * largest, np.finfo(float).tiny))
        mean: Array = q.sum(axis=-1) / common
        if q.shape[-1] == 1:
            return np.asarray(mean[..., None])
        weight = np.where(largest > 0.0, common / (common * mean**2 + 1.0), 1.0)
        widened = P + weight[..., None, None] * np.eye(q.shape[-1])
        estimate: Array = np.linalg.solve(widened, (q + (weight * mean)[..., None])[..., None])[..., 0]
        return estimate

    def marginalise_deviation(self, deviation: float | Array, earlier: "Likelihood | None" = None) -> "Likelihood":
        """Returns the likelihood of material means mu with rho = mu + delta, delta ~ N(0, diag(deviation rho_hat)^2).

        rho_hat is the estimate of the object's densities from these data alone, and no belief, so that the likelihood
        is the same whatever was learned before. Its own error matters little: where the data determine a density it
        is at most about as large as the error of the data, which the likelihood has anyway. The constant is dropped:
        the evidence of a trial is that of the object's own densities.

        Args:
            deviation: Scatter of objects within a material, as a fraction of the density: a number, or one for each
                entry along the leading dimensions.
            earlier: Sum of the likelihoods of earlier trials with the same object, whose deviation is the same. Given
                these, the result is what this trial adds: the likelihood of all trials in place of that of the
                earlier ones. It may be negative, as a trial may show that the object is denser than it seemed.
        """
        if earlier is not None:
            after, before = (
                self.add(earlier).marginalise_deviation(deviation),
                earlier.marginalise_deviation(deviation),
            )
            precision = after.precision - before.precision
            return Likelihood(precision, after.information_vector - before.information_vector, np.nan)
        P, q, rho = self.precision, self.information_vector, self.estimate_densities()
        variance = (np.asarray(deviation)[..., None] * rho) ** 2
        spread = np.eye(q.shape[-1]) + P * variance[..., None, :]
        precision, information_vector = np.linalg.solve(spread, P), np.linalg.solve(spread, q[..., None])[..., 0]
        return Likelihood(0.5 * (precision + np.swapaxes(precision, -1, -2)), information_vector, np.nan)


@dataclass(frozen=True)
class Quadratic:
    """Quadratic log likelihood, log L(pi) = -pi^T H pi / 2 + b^T pi + constant."""

    precision: Array  # H, shape (10, 10); may be singular
    information: Array  # b, shape (10,)

    def widen(self, covariance: Array) -> "Quadratic":
        """Returns the quadratic widened by parameter errors with a covariance, shape (10, 10)."""
        A = np.linalg.inv(np.eye(len(self.information)) + self.precision @ covariance)
        precision = A @ self.precision
        return Quadratic(0.5 * (precision + precision.T), A @ self.information)

    def restrict(self, Phi: Array) -> Likelihood:
        """Restricts the quadratic to bodies Phi rho of densities rho, Phi of shape (10, M).

        The constant makes the log likelihood of the parameters that fit best zero.
        """
        H, b = self.precision, self.information
        values, vectors = np.linalg.eigh(H)
        seen = values > SEEN * values[-1]
        distance = float(((vectors.T @ b)[seen] ** 2 / values[seen]).sum())
        return Likelihood(Phi.T @ H @ Phi, Phi.T @ b, -0.5 * distance, 0.0, int(seen.sum()))

    def change_frame(self, to_here: Array) -> "Quadratic":
        """Returns the quadratic of the parameters in another frame, from which to_here, (10, 10), leads to these."""
        precision = to_here.T @ self.precision @ to_here
        return Quadratic(0.5 * (precision + precision.T), to_here.T @ self.information)

    def find_load(self, pi: Array, covariance: Array) -> Array:
        """Finds the most probable load, (10,), given a body, (10,), and the covariance of its error, (10, 10)."""
        missing = self.information - self.precision @ pi
        load: Array = pi + covariance @ np.linalg.solve(np.eye(len(pi)) + self.precision @ covariance, missing)
        return load

    def evaluate(self, pi: Array) -> Array:
        """Computes the value at N points, shape (N, 10), without the constant; shape (N,)."""
        value: Array = pi @ self.information - 0.5 * np.einsum("ni,ij,nj->n", pi, self.precision, pi, optimize=True)
        return value

    def about(self, origin: Array) -> "Quadratic":
        """Returns the quadratic as a function of pi - origin, origin of shape (10,)."""
        return Quadratic(self.precision, self.information - self.precision @ origin)
