"""Quadratic log likelihoods of the ten inertial parameters of a body."""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.objects.inertia import NUM_PARAMETERS

# Share of the largest eigenvalue of a precision below which eigenvalues carry no information.
SEEN = 1e-12


@dataclass(frozen=True)
class Quadratic:
    """Quadratic log likelihood, log L(pi) = -pi^T H pi / 2 + b^T pi + constant.

    Attributes:
        precision: Precision matrix H, shape (10, 10); may be singular.
        information: Information vector b, shape (10,).
    """

    precision: Array
    information: Array

    def widen(self, covariance: Array) -> "Quadratic":
        """Returns the quadratic widened by parameter errors with a covariance, shape (10, 10)."""
        A = np.linalg.inv(np.eye(NUM_PARAMETERS) + self.precision @ covariance)
        precision = A @ self.precision
        return Quadratic(0.5 * (precision + precision.T), A @ self.information)

    def restrict(self, Phi: Array) -> Likelihood:
        """Restricts the quadratic to bodies Phi rho of densities rho, Phi of shape (10, M).

        The constant of the likelihood is that of the parameters that fit best.
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
