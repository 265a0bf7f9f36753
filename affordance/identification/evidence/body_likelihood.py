"""Likelihood of a body, with errors of the arm's model integrated out of that of the load.

Errors of the arm's model are a phantom payload delta, delta ~ N(0, C), and the load is the sum of body pi and delta.
With Q the quadratic approximation of log L near the most probable load, and Q_C that with delta integrated out,

    log p(signals | pi) = Q_C(pi) + log E[exp(log L(pi + delta) - Q(pi + delta))],    delta ~ N(0, C) exp Q(pi + .)

and the expectation is estimated by one draw: exact without a phantom, and unbiased with one.
"""

import numpy as np

from affordance.arrays import Array
from affordance.identification.evidence.payload_likelihood import PayloadLikelihood, factor
from affordance.objects.inertia import NUM_PARAMETERS


class BodyLikelihood:
    """Log likelihood log p(run | pi) of bodies, with the phantom payload integrated out."""

    def __init__(self, likelihood: PayloadLikelihood, load: Array) -> None:
        """Prepares the quadratics about a load of high likelihood, shape (10,)."""
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
        """Draws the standard normal numbers from which phantoms of N bodies follow, (N, 10); zeros without one."""
        shape = num_bodies, NUM_PARAMETERS
        return rng.standard_normal(shape) if self._has_phantom else np.zeros(shape)

    def compute(self, pi: Array, normals: Array) -> Array:
        """Computes the log likelihood at N bodies, (N, 10), with a phantom by normal numbers, (N, 10); shape (N,).

        It is known up to one constant for all, and without bias if the normal numbers are independent.
        """
        if not self._has_phantom:
            return self._likelihood.compute_log_likelihood(pi)
        delta = (self.of_load.information - pi @ self.of_load.precision) @ self._share
        load = pi + delta + normals @ self._spread.T
        rest = self._likelihood.compute_log_likelihood(load) - self.of_load.evaluate(load)
        return self.of_body.evaluate(pi) + rest
