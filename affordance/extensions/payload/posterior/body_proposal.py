"""Proposal distribution of bodies for samples of a posterior.

It is a mixture of a multivariate t distribution for each kind of solid, with tails at least as heavy as the
posterior's, and, with a small weight, of the prior, which bounds the weights of the samples.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, gammaln, ndtri

from affordance.arrays import Array
from affordance.extensions.payload.posterior.even_points import draw_even_points
from affordance.extensions.payload.posterior.solid_prior import Normals, SolidPrior, add_logs

# Degrees of freedom of a multivariate t: its tails are heavier than the posterior's, so that no single sample
# dominates.
_DEGREES_OF_FREEDOM = 8.0
# Share of the samples that are drawn from the prior, and share of the others that is divided equally among the kinds.
_DEFENSIVE, _EVEN = 0.05, 0.05
# Number of samples above which evenly spread points are used.
_MANY = 4000
_LEAST_UNIFORM = 1e-12  # keeps all samples at finite distances
# Least effective number of samples from which the distribution of a kind is refitted.
_FEWEST = 30.0
# Share of a kind's covariance that a refit retains, so that it does not collapse onto a few samples of large weight.
_KEPT = 0.1


@dataclass(frozen=True)
class Proposal:
    """Mixture of t distributions and a prior."""

    kinds: Normals  # centre and squared scale of each t distribution
    shares: Array  # share of each t distribution, shape (K,); they sum to one
    prior: SolidPrior  # prior of the body

    @classmethod
    def build(cls, kinds: Normals, log_evidence: Array, prior: SolidPrior) -> "Proposal":
        """Builds the proposal from kinds and the unnormalised logarithms of their probabilities, shape (K,)."""
        weights = np.exp(log_evidence - log_evidence.max())
        return cls(kinds, (1.0 - _EVEN) * weights / weights.sum() + _EVEN / len(weights), prior)

    @property
    def covariance(self) -> Array:
        """Mean of the squared scales of the t distributions, shape (10, 10)."""
        covariance: Array = np.einsum("k,kij->ij", self.shares, self.kinds.covariances)
        return covariance

    def draw(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws samples of theta, shape (num_samples, 10)."""
        num_prior = int(_DEFENSIVE * num_samples)
        count, size = num_samples - num_prior, self.kinds.means.shape[1]
        # With evenly spread points, interval edges scatter between seeds half as much as with independent points.
        # Those take less than a millisecond to draw.
        spread = draw_even_points(rng, count, size + 1) if num_samples > _MANY else rng.random((count, size + 1))
        spread = np.clip(spread, _LEAST_UNIFORM, 1.0 - _LEAST_UNIFORM)
        scale = np.sqrt(_DEGREES_OF_FREEDOM / chdtri(_DEGREES_OF_FREEDOM, spread[:, size]))
        about = ndtri(spread[:, :size]) * scale[:, None]
        ends = np.round(np.cumsum(self.shares) * count).astype(int)
        for k, (start, end) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
            about[start:end] = self.kinds.means[k] + about[start:end] @ self.kinds.roots[k].T
        return np.concatenate([about, self.prior.draw_theta(rng, num_prior)])

    def compute_log_density(self, theta: Array, prior: Array) -> Array:
        """Computes the log density, (N,), up to a constant common to all components, given the prior's, (N,)."""
        about = add_logs(self._compute_log_densities(theta))
        log_density: Array = np.logaddexp(np.log(1.0 - _DEFENSIVE) + about, np.log(_DEFENSIVE) + prior)
        return log_density

    def refit(self, theta: Array, weights: Array) -> "Proposal":
        """Returns the proposal refitted, kind by kind, to samples of the posterior, (N, 10), with weights, (N,)."""
        log_densities = self._compute_log_densities(theta)
        belongs = np.exp(log_densities - add_logs(log_densities)[:, None]) * weights[:, None]
        means, covariances = self.kinds.means.copy(), self.kinds.covariances.copy()
        for k, share in enumerate(belongs.T):
            total = share.sum()
            if total**2 <= _FEWEST * (share**2).sum():
                continue
            means[k] = share @ theta / total
            away = theta - means[k]
            covariances[k] = (away * share[:, None]).T @ away / total + _KEPT * covariances[k]
        with np.errstate(divide="ignore"):
            log_evidence = np.log(belongs.sum(axis=0))
        return Proposal.build(Normals(means, covariances), log_evidence, self.prior)

    def _compute_log_densities(self, theta: Array) -> Array:
        """Computes the log density of each t distribution times its share, up to a common constant, (N, K)."""
        size = self.kinds.means.shape[1]
        half, power = 0.5 * _DEGREES_OF_FREEDOM, 0.5 * (_DEGREES_OF_FREEDOM + size)
        scales = self.kinds.log_scales + gammaln(power) - gammaln(half) - 0.5 * size * np.log(half)
        tails = power * np.log1p(self.kinds.measure_squares(theta) / _DEGREES_OF_FREEDOM)
        log_densities: Array = np.log(self.shares) + scales - tails
        return log_densities
