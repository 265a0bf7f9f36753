"""The likelihood of what an object at rest feels like, at a small part of the cost: for hundreds of lifts.

It is that of ``WeberNoise`` for an arm that does not move and an object whose geometry is exact: errors of the joints
are then independent, and nothing is factorised.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.torque_noise import WeberNoise


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

    def compute_likelihood(self, rho: Array) -> Likelihood:
        """Likelihood of the densities with errors of the size at the torque that densities rho, (M,), predict."""
        predicted = self.tau_arm + self.regressor @ rho
        variances = self.noise.threshold**2 + (self.noise.weber_fraction * predicted) ** 2
        weighted = self.regressor.T / variances
        log_scale = float(np.log(2.0 * np.pi * variances).sum())
        log_constant = -0.5 * (float((self.residual**2 / variances).sum()) + log_scale)
        return Likelihood(
            weighted @ self.regressor, weighted @ self.residual, log_constant, -0.5 * log_scale, len(variances)
        )

    def find_likelihood(self, belief: DensityBelief) -> Likelihood:
        """Likelihood of the densities; errors have the size that belief and percept together lead to expect.

        Costs a few products of (M, num_joints) matrices and a solve of M equations in each of about ten iterations.

        Args:
            belief: About the densities before, of size M.
        """
        return find_fixed_point(belief, self.compute_likelihood)
