"""Beliefs about material densities: normal distributions restricted to positive densities.

    p(rho) is proportional to exp(-rho^T Lambda rho / 2 + eta^T rho) if rho > 0, and zero otherwise

Lambda is the precision and eta the information vector. An update adds the likelihood's terms to both, so the order of
updates does not matter.
"""

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from affordance.arguments import check_array, check_fractions, check_symmetry
from affordance.arrays import Array
from affordance.belief import truncated_normal as positive_gaussian
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals, compute_mode
from affordance.belief.prior import Prior as Prior
from affordance.exceptions import BadArgumentError

# Largest number of densities that are printed in a line.
_MOST_SHOWN = 8
_FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)
# Number of Gauss-Hermite nodes for the variance; the outermost node is at 5.5 SDs.
_NUM_NODES = 12
# Smallest density that is printed without decimals, [kg/m^3].
_WHOLE = 10.0


class PointEstimate(enum.Enum):
    """Point estimate of a density, for controllers that need a single value."""

    MODE = "mode"  # the most probable density (paper, IV-A)
    SAMPLE = "sample"  # a random draw (paper, III)
    MEAN = "mean"  # for comparison only
    MEDIAN = "median"  # for comparison only


# Lower bound of point estimates: the lightest solid in common use, foamed polystyrene, [kg/m^3].
DENSITY_FLOOR = 10.0


@dataclass(frozen=True)
class DensityBelief:
    """Distribution of M densities, [kg/m^3]."""

    precision: Array  # Lambda of the unrestricted normal distribution, shape (M, M), read-only
    information_vector: Array  # eta, shape (M,), read-only

    def __post_init__(self) -> None:
        """Stores read-only copies of the arrays.

        Raises:
            BadArgumentError: The precision is not symmetric or not positive definite, a value is not finite, or
                shapes do not match.
        """
        information_vector = check_array("information_vector", self.information_vector, (None,)).copy()
        size = information_vector.size
        precision = check_array("precision", self.precision, (size, size)).copy()
        check_symmetry("precision", precision)
        if size and np.linalg.eigvalsh(precision)[0] <= 0.0:
            raise BadArgumentError("precision", "", "is not positive definite, must be positive definite")
        precision.setflags(write=False)
        information_vector.setflags(write=False)
        object.__setattr__(self, "precision", precision)
        object.__setattr__(self, "information_vector", information_vector)

    def __repr__(self) -> str:
        return f"DensityBelief({self.describe()})"

    def describe(self) -> str:
        """Formats means and SDs of the unrestricted normal distribution in one line."""
        sds = np.sqrt(np.diag(self.covariance))
        texts = [
            f"{show_density(mean)} ± {show_density(sd)}" for mean, sd in zip(self.untruncated_mean, sds, strict=True)
        ]
        shown = texts if len(texts) <= _MOST_SHOWN else [*texts[: _MOST_SHOWN - 1], f"{len(texts)} in all"]
        return f"{', '.join(shown)} kg/m^3" if texts else "of no density"

    @classmethod
    def from_normals(cls, normals: Normals) -> "DensityBelief":
        """Builds the belief of a single observer."""
        if normals.information is not None:
            return cls(normals.precision[0], normals.information_vector[0])
        return cls.from_moments(normals.mean[0], normals.covariance[0])

    @classmethod
    def from_moments(cls, mean: Array, covariance: Array) -> "DensityBelief":
        """Builds the belief from mean, (M,), and covariance, (M, M), of the unrestricted normal distribution.

        Raises:
            BadArgumentError: The covariance is not positive definite, shapes do not match, or a value is not finite.
        """
        mean = check_array("mean", mean, (None,))
        covariance = check_array("covariance", covariance, (mean.size, mean.size))
        check_symmetry("covariance", covariance)
        try:
            precision = np.linalg.inv(covariance)
        except np.linalg.LinAlgError as error:
            raise BadArgumentError("covariance", "", "is singular, must be positive definite") from error
        precision = 0.5 * (precision + precision.T)
        return cls(precision, precision @ mean)

    @property
    def size(self) -> int:
        """Number of densities M."""
        return len(self.information_vector)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the unrestricted normal distribution, shape (M, M)."""
        covariance = np.linalg.inv(self.precision)
        return 0.5 * (covariance + covariance.T)

    @cached_property
    def untruncated_mean(self) -> Array:
        """Mean of the unrestricted normal distribution, shape (M,); may be negative."""
        untruncated_mean: Array = self.covariance @ self.information_vector
        return untruncated_mean

    @cached_property
    def normals(self) -> Normals:
        """Unrestricted normal distribution, as an array of length one."""
        return Normals.from_information(self.precision[None], self.information_vector[None])

    def select(self, indices: Sequence[int]) -> "DensityBelief":
        """Returns the marginal distribution of selected densities, in the order of the indices."""
        chosen = list(indices)
        if chosen == list(range(self.size)):
            return self
        return DensityBelief.from_moments(self.untruncated_mean[chosen], self.covariance[np.ix_(chosen, chosen)])

    def condition(self, likelihood: Likelihood) -> "DensityBelief":
        """Returns the posterior given a likelihood (Bayes' rule)."""
        return DensityBelief(
            self.precision + likelihood.precision, self.information_vector + likelihood.information_vector
        )

    def extend(self, prior: Prior, count: int) -> "DensityBelief":
        """Adds a number of independent materials that have the prior."""
        return self.extend_by([prior.mode] * count, [prior.sd] * count)

    def extend_by(self, means: Sequence[float], sds: Sequence[float]) -> "DensityBelief":
        """Adds independent materials with given means and standard deviations."""
        precision = np.diag([*np.zeros(self.size), *(sd**-2 for sd in sds)])
        precision[: self.size, : self.size] = self.precision
        added = [mean / sd**2 for mean, sd in zip(means, sds, strict=True)]
        return DensityBelief(precision, np.append(self.information_vector, added))

    def add_object_variation(self, deviation: float, num_objects: int = 1) -> "DensityBelief":
        """Returns the joint belief about the densities of several objects of these materials.

        Object densities are mu (1 + delta). Each delta ~ N(0, deviation^2) is independent. The moments are exact.

        Args:
            deviation: SD of object densities about the mean density of the material, as a fraction of the mean.
            num_objects: Number of objects.

        Returns:
            Belief of size num_objects * M, ordered by object.
        """
        squares = np.tile(self.untruncated_mean**2 + np.diag(self.covariance), num_objects)
        covariance = np.tile(self.covariance, (num_objects, num_objects))
        covariance[np.diag_indices(len(covariance))] += deviation**2 * squares
        return DensityBelief.from_moments(np.tile(self.untruncated_mean, num_objects), covariance)

    def compute_point_estimate(self, point_estimate: PointEstimate, rng: np.random.Generator) -> Array:
        """Computes point estimates of the densities, at least DENSITY_FLOOR, (M,), [kg/m^3]."""
        match point_estimate:
            case PointEstimate.MODE:
                return self.compute_mode()
            case PointEstimate.SAMPLE:
                rho = self.draw_samples(rng, 1)[0]
            case PointEstimate.MEAN:
                rho = self.compute_mean()
            case PointEstimate.MEDIAN:
                rho = self.compute_percentiles([0.5])[0]
        floored: Array = np.maximum(rho, DENSITY_FLOOR)
        return floored

    def compute_mode(self) -> Array:
        """Computes the mode of the densities, at least DENSITY_FLOOR, (M,), [kg/m^3]."""
        return compute_mode(self.untruncated_mean, self.precision, DENSITY_FLOOR)

    def compute_mean(self) -> Array:
        """Computes the mean densities, shape (M,), [kg/m^3]."""
        return positive_gaussian.compute_mean(self.untruncated_mean, self.covariance)

    def compute_percentiles(self, fractions: Sequence[float]) -> Array:
        """Computes percentiles of each density at P cumulative probabilities, shape (P, M), [kg/m^3]."""
        chosen = check_fractions("fractions", fractions)
        return positive_gaussian.compute_percentiles(self.untruncated_mean, self.covariance, chosen)

    def draw_samples(self, rng: np.random.Generator, num_samples: int, *, is_even: bool = False) -> Array:
        """Draws samples of the densities, (num_samples, M), [kg/m^3].

        Args:
            rng: Random number generator.
            num_samples: Number of samples.
            is_even: If True, draws evenly spread samples, otherwise independent samples.
        """
        return positive_gaussian.draw_samples(
            self.untruncated_mean, self.covariance, rng, num_samples, is_even=is_even
        )

    def compute_log_evidence(self, likelihood: Likelihood) -> float:
        """Computes the log evidence of data: the log of the integral of p(data | rho) p(rho) over rho > 0."""
        posterior = self.condition(likelihood)
        return float(
            self.compute_untruncated_log_evidence(likelihood, posterior)
            + positive_gaussian.compute_log_mass(posterior.untruncated_mean, posterior.covariance)
            - positive_gaussian.compute_log_mass(self.untruncated_mean, self.covariance)
        )

    def compute_untruncated_log_evidence(self, likelihood: Likelihood, posterior: "DensityBelief") -> float:
        """Computes the log evidence of data under the unrestricted distribution, in closed form.

        Args:
            likelihood: Likelihood of the data.
            posterior: This belief conditioned on the likelihood.
        """
        return float(self.normals.compute_log_evidence(likelihood, posterior.normals)[0])

    def compute_p_value(self, likelihood: Likelihood, dof: float = np.inf) -> float:
        """Computes the p-value of data: the predictive probability of data with at most this evidence.

        The restriction to positive densities is ignored. See ``Normals.compute_p_value``.
        """
        return float(self.normals.compute_p_value(likelihood, dof)[0])


EMPTY_BELIEF = DensityBelief(np.zeros((0, 0)), np.zeros(0))


def show_density(density: float) -> str:
    """Formats a density in kg/m^3: as an integer, or with two significant digits if it is small."""
    return f"{density:.0f}" if abs(density) >= _WHOLE else f"{density:.2g}"


class Density(NamedTuple):
    """Mean, SD and percentiles of the belief about one colour's mean density, [kg/m^3]."""

    mean: float
    sd: float
    p05: float
    p25: float
    median: float
    p75: float
    p95: float

    def __repr__(self) -> str:
        interval = f"90 % from {show_density(self.p05)} to {show_density(self.p95)}"
        return f"Density({show_density(self.mean)} ± {show_density(self.sd)} kg/m^3, {interval})"


def summarise_density(belief: DensityBelief, index: int) -> Density:
    """Computes mean, SD and percentiles of one density, [kg/m^3]."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NUM_NODES)
    percentiles = belief.compute_percentiles([*_FRACTIONS, *ndtr(nodes)])[:, index]
    mean = float(belief.compute_mean()[index])
    squares = (percentiles[len(_FRACTIONS) :] - mean) ** 2
    sd = float(np.sqrt(weights @ squares / weights.sum()))
    p05, p25, median, p75, p95 = (float(value) for value in percentiles[: len(_FRACTIONS)])
    return Density(mean, sd, p05, p25, median, p75, p95)
