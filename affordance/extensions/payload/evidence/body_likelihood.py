"""Likelihood of a body, with the errors of the arm's model integrated out.

Errors of the arm's model are represented by a phantom payload delta ~ N(0, C), so that the load is the sum of the
body pi and delta. With Q the quadratic approximation of log L near the most probable load, and Q_C that approximation
with delta integrated out,

    log p(signals | pi) = Q_C(pi) + log E[exp(log L(pi + delta) - Q(pi + delta))],    delta ~ N(0, C) exp Q(pi + .)

The expectation is estimated from one draw: exactly without a phantom, and without bias with one.
"""

import numpy as np

from affordance.arrays import Array
from affordance.extensions.payload.evidence.payload_likelihood import PayloadLikelihood, factor
from affordance.objects.inertia import NUM_PARAMETERS


class BodyLikelihood:
    """Log likelihood log p(run | pi) of bodies, with the phantom payload integrated out."""

    def __init__(self, likelihood: PayloadLikelihood, load: Array) -> None:
        """Prepares the quadratic approximations about a load of high likelihood, shape (10,)."""
        self._likelihood = likelihood
        self.of_load = likelihood.linearise(load)
        covariance = likelihood.prior.phantom_covariance
        self.of_body = self.of_load.widen(covariance)
        root = factor(covariance)
        self._has_phantom = bool(root.any())
        inner = np.linalg.inv(np.eye(NUM_PARAMETERS) + root.T @ self.of_load.precision @ root)
        self._share = root @ inner @ root.T
        self._spread = root @ np.linalg.cholesky(0.5 * (inner + inner.T))

    def draw_normals(self, rng: np.random.Generator, num_bodies: int) -> Array:
        """Draws standard normal numbers for the phantoms of N bodies, (N, 10); zeros without a phantom."""
        shape = num_bodies, NUM_PARAMETERS
        return rng.standard_normal(shape) if self._has_phantom else np.zeros(shape)

    def compute(self, pi: Array, normals: Array) -> Array:
        """Computes the log likelihood of N bodies, (N, 10), up to a constant common to all; shape (N,).

        Each body's phantom follows from its row of normal numbers, (N, 10). The likelihood is unbiased if these are
        independent.
        """
        if not self._has_phantom:
            return self._likelihood.compute_log_likelihood(pi)
        delta = (self.of_load.information - pi @ self.of_load.precision) @ self._share
        load = pi + delta + normals @ self._spread.T
        rest = self._likelihood.compute_log_likelihood(load) - self.of_load.evaluate(load)
        return self.of_body.evaluate(pi) + rest
