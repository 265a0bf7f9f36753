"""Prior of a held body that no camera has seen: any solid that a hand could hold.

It is a mixture of normal distributions over the log-Cholesky coordinates, one fitted to each kind of random solids.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from affordance.arrays import Array
from affordance.identification.posterior.log_cholesky import parameters_from_theta, theta_from_parameters
from affordance.identification.posterior.normals import Normals, add_logs
from affordance.identification.posterior.random_solids import draw_random_solids


@dataclass(frozen=True)
class SolidPrior:
    """Mixture of normal distributions of theta (see log_cholesky), whose samples are physically consistent bodies.

    Attributes:
        kinds: Distribution of theta for each of K kinds of solids.
        shares: Probability of each kind, shape (K,); their sum is one.
    """

    kinds: Normals
    shares: Array

    @classmethod
    @cache
    def for_hand(cls) -> "SolidPrior":
        """Returns the prior of any solid that a hand could hold."""
        return cls.from_samples(*draw_random_solids(np.random.default_rng(0)))

    @classmethod
    def from_samples(cls, *kinds: Array) -> "SolidPrior":
        """Fits the prior to bodies of one or several equally probable kinds, parameters (N, 10) with N well above 10.

        A body that is not physically consistent raises a numpy.linalg.LinAlgError.
        """
        thetas = [theta_from_parameters(pi) for pi in kinds]
        means = np.array([theta.mean(axis=0) for theta in thetas])
        return cls(
            Normals(means, np.array([np.cov(theta.T) for theta in thetas])), np.full(len(kinds), 1 / len(kinds))
        )

    def with_mass(self, mass: float, sd: float) -> "SolidPrior":
        """Returns the prior of a weighed body, conditioned on its mass and the mass's SD, [kg]."""
        means, C = self.kinds.means, self.kinds.covariances
        away, variance = np.log(mass) - means[:, 0], C[:, 0, 0]
        gain = C[:, 0] / variance[:, None]
        less = ((sd / mass) ** 2 - variance)[:, None, None]
        kinds = Normals(means + gain * away[:, None], C + gain[:, :, None] * gain[:, None, :] * less)
        shares = self.shares * np.exp(-0.5 * away**2 / variance) / np.sqrt(variance)
        return SolidPrior(kinds, shares / shares.sum())

    def with_common_factor(self, sd: float) -> "SolidPrior":
        """Returns the prior of a body whose torques share a factor, its logarithm normal with this SD."""
        covariances = np.array(self.kinds.covariances)
        covariances[:, 0, 0] += sd**2
        return SolidPrior(Normals(self.kinds.means, covariances), self.shares)

    def remove_common_factor(self, pi: Array, sd: float, rng: np.random.Generator) -> Array:
        """Draws bodies without the common factor, given bodies with it, pi of shape (N, 10)."""
        if sd == 0.0:
            return pi
        widened = self.with_common_factor(sd)
        # A micrometre of thickness keeps the thinnest bodies factorable.
        thick = pi + pi[:, :1] * np.array([0.0, 0.0, 0.0, 0.0, 1e-12, 1e-12, 1e-12, 0.0, 0.0, 0.0])
        theta = theta_from_parameters(thick)
        log_densities = widened.compute_log_densities(theta)
        # The largest of the densities' products with Gumbel noise belongs to each kind with its probability.
        kind = np.argmax(log_densities + rng.gumbel(size=log_densities.shape), axis=1)
        share = sd**2 * widened.kinds.precisions[:, 0]  # part of a deviation that the factor explains, (K, 10)
        mean = np.einsum("nd,nd->n", theta - widened.kinds.means[kind], share[kind])
        spread = np.sqrt(np.maximum(sd**2 * (1.0 - share[:, 0]), 0.0))[kind]
        factor = np.exp(mean + spread * rng.standard_normal(len(pi)))
        body: Array = pi / factor[:, None]
        return body

    @cached_property
    def mean(self) -> Array:
        """Mean of theta, shape (10,)."""
        mean: Array = self.shares @ self.kinds.means
        return mean

    @cached_property
    def covariance(self) -> Array:
        """Covariance of theta, shape (10, 10)."""
        away = self.kinds.means - self.mean
        within = np.einsum("k,kij->ij", self.shares, self.kinds.covariances)
        covariance: Array = within + (away.T * self.shares) @ away
        return covariance

    @cached_property
    def precision(self) -> Array:
        """Inverse of the covariance, shape (10, 10)."""
        inverse = np.linalg.inv(self.covariance)
        return 0.5 * (inverse + inverse.T)

    def compute_log_density(self, theta: Array) -> Array:
        """Computes the log density up to a constant, theta of shape (N, 10), result (N,)."""
        return add_logs(self.compute_log_densities(theta))

    def compute_log_densities(self, theta: Array) -> Array:
        """Computes the log density of each kind, its share included, up to one constant for all, (N, K)."""
        squares = self.kinds.measure_squares(theta)
        log_densities: Array = np.log(self.shares) + self.kinds.log_scales - 0.5 * squares
        return log_densities

    def draw_theta(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies as log-Cholesky coordinates, shape (num_samples, 10)."""
        kind = rng.choice(len(self.shares), size=num_samples, p=self.shares)
        normal = rng.standard_normal((num_samples, self.kinds.means.shape[1]))
        theta: Array = self.kinds.means[kind] + np.einsum("nij,nj->ni", self.kinds.roots[kind], normal)
        return theta

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies, shape (num_samples, 10)."""
        return parameters_from_theta(self.draw_theta(rng, num_samples))
