"""Unrestricted normal distributions of densities, in arrays for many observers.

The module ``density_belief`` restricts a single distribution to positive densities, and computes samples and
summaries.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy  # imports its submodules on first use
from scipy.special import chdtrc, fdtrc  # scipy.stats takes a second to import

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood


@dataclass(frozen=True)
class Normals:
    """Normal distributions of M densities, [kg/m^3], for N observers or hypotheses."""

    mean: Array  # (N, M)
    covariance: Array  # (N, M, M), positive definite
    # Precision and information vector if the distributions were built from them, to avoid rounding errors.
    information: tuple[Array, Array] | None = None

    @classmethod
    def from_information(cls, precision: Array, information_vector: Array) -> "Normals":
        """Builds the distributions from precisions, (N, M, M), and information vectors, (N, M)."""
        covariance = invert(precision)
        return cls(np.matvec(covariance, information_vector), covariance, (precision, information_vector))

    @cached_property
    def precision(self) -> Array:
        """Inverse of the covariance, (N, M, M)."""
        return invert(self.covariance) if self.information is None else self.information[0]

    @cached_property
    def information_vector(self) -> Array:
        """Precision times mean, (N, M)."""
        if self.information is not None:
            return self.information[1]
        information_vector: Array = np.matvec(self.precision, self.mean)
        return information_vector

    def __len__(self) -> int:
        return len(self.mean)

    def take(self, rows: Any) -> "Normals":
        """Selects observers or hypotheses."""
        return Normals(self.mean[rows], self.covariance[rows])

    def select(self, columns: Sequence[int]) -> "Normals":
        """Returns the marginal distributions of selected densities."""
        chosen = list(columns)
        return Normals(self.mean[:, chosen], self.covariance[:, *np.ix_(chosen, chosen)])

    def widen(self, sds: Array) -> "Normals":
        """Adds independent errors with SDs of shape (N, M) or (N, 1)."""
        covariance = self.covariance + np.eye(self.mean.shape[1]) * sds[:, None, :] ** 2
        return Normals(self.mean, covariance)

    def vary(self, deviation: Array) -> "Normals":
        """Converts distributions of mean densities mu to distributions of object densities mu (1 + delta).

        Args:
            deviation: SD of the independent normal variables delta, (N,).
        """
        squares = self.mean**2 + np.diagonal(self.covariance, axis1=1, axis2=2)
        return self.widen(deviation[:, None] * np.sqrt(squares))

    def condition(self, likelihood: Likelihood) -> "Normals":
        """Returns the posteriors given likelihoods (Bayes' rule)."""
        return Normals.from_information(
            self.precision + likelihood.precision, self.information_vector + likelihood.information_vector
        )

    def compute_log_evidence(self, likelihood: Likelihood, posterior: "Normals") -> Array:
        """Computes the log evidence of data in closed form, (N,).

        Args:
            likelihood: Likelihood of the data.
            posterior: These distributions conditioned on the likelihood.
        """
        gained = _multiply(posterior) - _multiply(self)
        log_volume = _compute_log_det(posterior.covariance) - _compute_log_det(self.covariance)
        log_evidence: Array = likelihood.log_constant + 0.5 * gained + 0.5 * log_volume
        return log_evidence

    def compute_p_value(self, likelihood: Likelihood, dof: float = np.inf) -> Array:
        """Computes p-values, (N,): predictive probabilities of data with at most this evidence.

        The log evidence is a constant minus half of a chi-squared variable, with one degree of freedom per measured
        value. If the error variances were estimated, an F test replaces the chi-squared test.

        Args:
            likelihood: Likelihood of the data.
            dof: Degrees of freedom of the estimated error variances; infinite if the variances are known.
        """
        distance = -2.0 * (likelihood.log_constant - likelihood.log_peak)
        distance = np.maximum(0.0, distance + _multiply(self) - _multiply(self.condition(likelihood)))
        count = likelihood.num_values
        if np.isinf(dof) or count == 0:
            return np.asarray(chdtrc(count, distance))
        return np.asarray(fdtrc(count, dof, distance / count))

    def compute_mode(self, floor: float) -> Array:
        """Computes the mode over densities of at least ``floor``, (N, M)."""
        modes = self.mean.copy()
        for row in np.flatnonzero((modes < floor).any(axis=1)):
            modes[row] = compute_mode(modes[row], self.precision[row], floor)
        return modes


def compute_mode(mean: Array, precision: Array, floor: float) -> Array:
    """Computes the mode of a normal distribution over values of at least ``floor``, (M,)."""
    if (mean >= floor).all():
        return mean.copy()
    # (x - mean)^T precision (x - mean) = |L^T (x - mean)|^2: non-negative least squares in x - floor.
    root = np.linalg.cholesky(precision).T
    return floor + scipy.optimize.nnls(root, root @ (mean - floor))[0]


def invert(matrices: Array) -> Array:
    """Inverts symmetric matrices, (..., M, M), and makes the result exactly symmetric."""
    if matrices.shape[-1] == 1:  # much faster
        return 1.0 / matrices
    inverse = np.linalg.inv(matrices)
    return 0.5 * (inverse + np.swapaxes(inverse, -1, -2))


def _multiply(normals: Normals) -> Array:
    product: Array = np.vecdot(normals.information_vector, normals.mean)
    return product


def _compute_log_det(covariance: Array) -> Array:
    if covariance.shape[-1] == 1:
        log_det: Array = np.log(covariance[:, 0, 0])
        return log_det
    return np.asarray(np.linalg.slogdet(covariance)[1])
