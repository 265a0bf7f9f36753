"""Linear-Gaussian likelihoods of densities."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array


class Likelihood(NamedTuple):
    """log p(data | rho) = -rho^T precision rho / 2 + information_vector^T rho + log_constant, for M densities.

    Attributes:
        precision: Shape (M, M).
        information_vector: Shape (M,).
        log_constant: Log density of the data under densities of zero.
        log_peak: Log density of data without error, the largest there can be; for how surprising data are.
        num_values: How many numbers were measured.
    """

    precision: Array
    information_vector: Array
    log_constant: float
    log_peak: float = np.nan
    num_values: int = 0

    def marginalise_deviation(self, deviation_sd: float) -> "Likelihood":
        """Likelihood of material means mu where rho = mu + delta and delta ~ N(0, deviation_sd^2 I).

        The constant is not carried over: the evidence of a trial is that of the object's own densities.
        """
        spread = np.eye(len(self.information_vector)) + deviation_sd**2 * self.precision
        precision = np.linalg.solve(spread, self.precision)
        return Likelihood(0.5 * (precision + precision.T), np.linalg.solve(spread, self.information_vector), np.nan)
