"""Linear-Gaussian likelihoods of densities."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array


class Likelihood(NamedTuple):
    """Log likelihood log p(data | rho) = -rho^T P rho / 2 + q^T rho + log_constant of M densities rho.

    Attributes:
        precision: Precision P, shape (M, M).
        information_vector: Information vector q, shape (M,).
        log_constant: Log probability density of the data if all densities are zero.
        log_peak: Log probability density of data without error, the largest possible, for p-values.
        num_values: Number of measured values.
    """

    precision: Array
    information_vector: Array
    log_constant: float
    log_peak: float = np.nan
    num_values: int = 0

    def select(self, columns: Sequence[int]) -> "Likelihood":
        """Returns the likelihood of some of the densities, where the others do not matter."""
        chosen = list(columns)
        P, q = self.precision[np.ix_(chosen, chosen)], self.information_vector[chosen]
        return self._replace(precision=P, information_vector=q)

    def embed(self, columns: Sequence[int], size: int) -> "Likelihood":
        """Returns the likelihood of ``size`` densities, of which ``columns`` are these."""
        S = np.eye(size)[list(columns)]
        return self._replace(precision=S.T @ self.precision @ S, information_vector=S.T @ self.information_vector)

    def add(self, other: "Likelihood") -> "Likelihood":
        """Returns the likelihood of both data."""
        return Likelihood(
            self.precision + other.precision,
            self.information_vector + other.information_vector,
            self.log_constant + other.log_constant,
            self.log_peak + other.log_peak,
            self.num_values + other.num_values,
        )

    def marginalise_deviation(self, deviation_sd: float, earlier: "Likelihood | None" = None) -> "Likelihood":
        """Returns the likelihood of material means mu with rho = mu + delta and delta ~ N(0, deviation_sd^2 I).

        The constant is dropped: the evidence of a trial is that of the object's own densities. After earlier trials
        with the same object, whose deviation is the same, the result is the information that this trial adds about
        mu.
        """
        P, q, identity = self.precision, self.information_vector, np.eye(len(self.information_vector))
        if earlier is None:
            spread = identity + deviation_sd**2 * P
            precision, information_vector = np.linalg.solve(spread, P), np.linalg.solve(spread, q)
        else:  # the difference of the marginals with and without this trial, without cancellation
            B = np.linalg.inv(identity + deviation_sd**2 * earlier.precision)
            K = B @ np.linalg.inv(identity + deviation_sd**2 * P @ B)
            precision = K @ P @ B
            information_vector = K @ (q - deviation_sd**2 * P @ B @ earlier.information_vector)
        return Likelihood(0.5 * (precision + precision.T), information_vector, np.nan)
