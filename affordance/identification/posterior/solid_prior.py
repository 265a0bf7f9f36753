"""Prior of a held body that no camera has seen: any solid that a hand could hold.

It is a normal distribution over the log-Cholesky coordinates, fitted to random solids.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from affordance.arrays import Array
from affordance.identification.posterior.log_cholesky import parameters_from_theta, theta_from_parameters
from affordance.objects.inertia import parameters_from_pseudo_inertia

# Solids of one to three boxes, each edge from 1 to 30 cm and each density from 100 to 8000 kg/m^3, log-uniform: from
# foam to steel, from a pen to a drawer. They lie within 15 cm (one SD) of the tip and 7 cm of one another.
_EDGES, _DENSITIES = (0.01, 0.30), (100.0, 8000.0)
_REACH_SD, _SPREAD_SD = 0.15, 0.07
# Masses from a pencil case to the payload of a large robot, log-uniform, [kg].
_MASSES = (0.02, 10.0)
_NUM_SOLIDS = 4000


@dataclass(frozen=True)
class SolidPrior:
    """Normal distribution of theta (see log_cholesky), whose samples are physically consistent bodies.

    Attributes:
        mean: Mean of theta, shape (10,).
        covariance: Covariance of theta, shape (10, 10).
    """

    mean: Array
    covariance: Array

    @classmethod
    @cache
    def for_hand(cls) -> "SolidPrior":
        """Returns the prior of any solid that a hand could hold."""
        rng = np.random.default_rng(0)
        shape = (_NUM_SOLIDS, 3)
        edges = _draw_log_uniform(rng, _EDGES, (*shape, 3))
        present = np.arange(3) < rng.integers(1, 4, _NUM_SOLIDS)[:, None]
        masses = present * edges.prod(axis=2) * _draw_log_uniform(rng, _DENSITIES, shape)
        masses *= (_draw_log_uniform(rng, _MASSES, (_NUM_SOLIDS,)) / masses.sum(axis=1))[:, None]
        centres = _REACH_SD * rng.standard_normal((_NUM_SOLIDS, 1, 3)) + _SPREAD_SD * rng.standard_normal((*shape, 3))
        R, _ = np.linalg.qr(rng.standard_normal((*shape, 3, 3)))
        second = (
            R * (edges**2 / 12.0)[..., None, :] @ R.swapaxes(-1, -2) + centres[..., :, None] * centres[..., None, :]
        )
        J = np.zeros((_NUM_SOLIDS, 4, 4))
        J[:, :3, :3] = np.einsum("np,npij->nij", masses, second)
        J[:, :3, 3] = J[:, 3, :3] = np.einsum("np,npi->ni", masses, centres)
        J[:, 3, 3] = masses.sum(axis=1)
        return cls.from_samples(np.array([parameters_from_pseudo_inertia(body) for body in J]))

    @classmethod
    def from_samples(cls, pi: Array) -> "SolidPrior":
        """Fits the prior to bodies that might be held, shape (N, 10) with N well above 10.

        Raises:
            numpy.linalg.LinAlgError: One of the bodies is not physically consistent.
        """
        theta = theta_from_parameters(pi)
        return cls(theta.mean(axis=0), np.cov(theta.T))

    def with_mass(self, mass: float, sd: float) -> "SolidPrior":
        """Returns the prior of a weighed body, conditioned on its mass and the mass's SD, [kg]."""
        log_sd = sd / mass
        gain = self.covariance[:, 0] / self.covariance[0, 0]
        mean = self.mean + gain * (np.log(mass) - self.mean[0])
        covariance = self.covariance + np.outer(gain, gain) * (log_sd**2 - self.covariance[0, 0])
        return SolidPrior(mean, covariance)

    def with_common_factor(self, sd: float) -> "SolidPrior":
        """Returns the prior of a body whose torques share a factor, its logarithm normal with this SD."""
        covariance = np.array(self.covariance)
        covariance[0, 0] += sd**2
        return SolidPrior(self.mean, covariance)

    def remove_common_factor(self, pi: Array, sd: float, rng: np.random.Generator) -> Array:
        """Draws bodies without the common factor, given bodies with it, pi of shape (N, 10)."""
        if sd == 0.0:
            return pi
        widened = self.with_common_factor(sd)
        share = sd**2 * widened.precision[0]  # part of the deviation from the mean that the factor explains
        mean = (theta_from_parameters(pi) - widened.mean) @ share
        spread = np.sqrt(max(sd**2 * (1.0 - share[0]), 0.0))
        factor = np.exp(mean + spread * rng.standard_normal(len(pi)))
        body: Array = pi / factor[:, None]
        return body

    @cached_property
    def precision(self) -> Array:
        """Inverse of the covariance, shape (10, 10)."""
        inverse = np.linalg.inv(self.covariance)
        return 0.5 * (inverse + inverse.T)

    def compute_log_density(self, theta: Array) -> Array:
        """Computes the log density up to a constant, theta of shape (N, 10), result (N,)."""
        away = theta - self.mean
        log_density: Array = -0.5 * np.einsum("ni,ij,nj->n", away, self.precision, away, optimize=True)
        return log_density

    def draw_theta(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies as log-Cholesky coordinates, shape (num_samples, 10)."""
        return rng.multivariate_normal(self.mean, self.covariance, num_samples, method="cholesky")

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws bodies, shape (num_samples, 10)."""
        return parameters_from_theta(self.draw_theta(rng, num_samples))


def _draw_log_uniform(rng: np.random.Generator, bounds: tuple[float, float], shape: tuple[int, ...]) -> Array:
    return np.exp(rng.uniform(np.log(bounds[0]), np.log(bounds[1]), shape))
