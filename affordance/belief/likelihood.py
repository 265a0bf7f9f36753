"""Linear-Gaussian likelihoods of densities."""

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

    def marginalise_deviation(self, deviation_sd: float) -> "Likelihood":
        """Returns the likelihood of material means mu with rho = mu + delta and delta ~ N(0, deviation_sd^2 I).

        The constant is dropped: the evidence of a trial is that of the object's own densities.
        """
        spread = np.eye(len(self.information_vector)) + deviation_sd**2 * self.precision
        precision = np.linalg.solve(spread, self.precision)
        return Likelihood(0.5 * (precision + precision.T), np.linalg.solve(spread, self.information_vector), np.nan)
