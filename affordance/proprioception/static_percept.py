"""The likelihood of what an object at rest feels like, at a small part of the cost: for hundreds of lifts.

It is that of ``WeberNoise`` for an arm that does not move and an object whose geometry is exact: errors of the joints
are then independent, and nothing is factorised.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.exceptions import AffordanceError
from affordance.proprioception.torque_noise import WeberNoise

_MAX_ITERATIONS = 100
_TOLERANCE = 1e-12


class StaticPercept(NamedTuple):
    """What was felt of one object at rest.

    Attributes:
        tau_arm: Torque of the arm alone, shape (num_joints,), [N m].
        regressor: Torque per density, Y Phi, shape (num_joints, M), [N m / (kg/m^3)].
        residual: Torque felt, less that of the arm alone, shape (num_joints,), [N m].
        noise: How well joints feel.
    """

    tau_arm: Array
    regressor: Array
    residual: Array
    noise: WeberNoise

    def find_likelihood(self, belief: DensityBelief) -> Likelihood:
        """Likelihood of the densities; errors have the size that belief and percept together lead to expect.

        Costs a few products of (M, num_joints) matrices and a solve of M equations in each of about ten iterations.

        Args:
            belief: About the densities before, of size M.

        Raises:
            AffordanceError: The size of the errors finds no fixed point.
        """
        rho = belief.untruncated_mean
        columns = self.regressor.T
        for _ in range(_MAX_ITERATIONS):
            predicted = self.tau_arm + self.regressor @ rho
            variances = self.noise.threshold**2 + (self.noise.weber_fraction * predicted) ** 2
            weighted = columns / variances
            precision, information_vector = weighted @ self.regressor, weighted @ self.residual
            previous = rho
            rho = _solve(belief.precision + precision, belief.information_vector + information_vector)
            if np.abs(rho - previous).max() <= _TOLERANCE * np.abs(rho).max():
                log_scale = float(np.log(2.0 * np.pi * variances).sum())
                log_constant = -0.5 * (float((self.residual**2 / variances).sum()) + log_scale)
                return Likelihood(precision, information_vector, log_constant, -0.5 * log_scale, len(variances))
        raise AffordanceError(
            f"the estimator found no fixed point in {_MAX_ITERATIONS} iterations; the last density changed by "
            f"{np.abs(rho - previous).max():.3g} kg/m^3"
        )


def _solve(A: Array, b: Array) -> Array:
    """Solves A x = b, shape (M, M) and (M,)."""
    return b / A[0] if len(b) == 1 else np.linalg.solve(A, b)
