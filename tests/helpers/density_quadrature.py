"""Posterior of densities given one log likelihood, by sums over a grid alone; sums use nothing of the library.

The mean density of material i is mu_i ~ N(m_i, s_i^2), truncated at 0, and the object's own density is
rho_i = mu_i (1 + f delta_i) with delta_i ~ N(0, 1).
"""

from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from affordance.belief.density_belief import summarise_density


class Moments(NamedTuple):
    """Moments of C own densities and of the mean densities of their materials, and the log evidence."""

    own_mean: np.ndarray
    own_covariance: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    log_evidence: float


def weigh_density(rho, mode, sd, deviation):
    """Sums over the deviation: the prior density of an own density, (N,), and mean and mean square of mu given it."""
    delta, weights = np.polynomial.hermite_e.hermegauss(12)
    stretch = 1.0 + deviation * delta
    mu = rho[:, None] / stretch
    density = weights / weights.sum() / stretch * norm.pdf(mu, mode, sd) / norm.cdf(mode / sd)
    total = density.sum(axis=1)
    return total, (density * mu).sum(axis=1) / total, (density * mu**2).sum(axis=1) / total


def integrate(log_likelihood, axes, modes, sds, deviation):
    """Sums over a tensor grid of own densities.

    Args:
        log_likelihood: Function of own densities, (N, C), that returns (N,).
        axes: Equally spaced densities for each of the C materials, at the middles of cells, [kg/m^3].
        modes: Modes of the mean densities, (C,), [kg/m^3].
        sds: SDs of them before truncation, (C,), [kg/m^3].
        deviation: SD of an own density, as a fraction of its material's mean.
    """

    def spread(values):
        """Repeats values along each axis over the whole grid, (N, C)."""
        return np.stack([each.ravel() for each in np.meshgrid(*values, indexing="ij")], axis=1)

    found = [weigh_density(*of_one, deviation) for of_one in zip(axes, modes, sds, strict=True)]
    prior, means, squares = (spread(values) for values in zip(*found, strict=True))
    points = spread(axes)
    log_p = log_likelihood(points) + np.log(prior).sum(axis=1) + sum(np.log(axis[1] - axis[0]) for axis in axes)
    log_evidence = float(logsumexp(log_p))
    p = np.exp(log_p - log_evidence)
    own_mean, mean = p @ points, p @ means
    own_covariance = (points - own_mean).T @ ((points - own_mean) * p[:, None])
    covariance = (means - mean).T @ ((means - mean) * p[:, None]) + np.diag(p @ (squares - means**2))
    return Moments(own_mean, own_covariance, mean, covariance, log_evidence)


def compare_moments(belief, mean, covariance, *, of_mean=0.005, of_sd=0.006):
    """Compares means and SDs of a belief, to what docs/decisions/0035-exact-belief.md says for one colour."""
    found = [summarise_density(belief, i) for i in range(belief.size)]
    np.testing.assert_allclose([each.mean for each in found], mean, rtol=of_mean)
    np.testing.assert_allclose([each.sd for each in found], np.sqrt(np.diag(covariance)), rtol=of_sd)
