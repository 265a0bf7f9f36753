"""Likelihood of the measured torques of an object at rest, at a small part of the cost, for hundreds of lifts.

It equals that of ``WeberNoise`` for an arm at rest and an object of exact geometry: errors of the joints are then
independent, and no matrix is factorised.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.torque_noise import WeberNoise


class StaticPercept(NamedTuple):
    """Measured torques of one object at rest.

    Attributes:
        tau_arm: Torque of the arm alone, shape (num_joints,), [N m].
        regressor: Torque per density, Y Phi, shape (num_joints, M), [N m / (kg/m^3)].
        residual: Measured torque less that of the arm alone, shape (num_joints,), [N m].
        noise: Errors of measured torques.
    """

    tau_arm: Array
    regressor: Array
    residual: Array
    noise: WeberNoise

    def compute_likelihood(self, rho: Array) -> Likelihood:
        """Computes the likelihood of the densities, with errors evaluated at the torque that rho, (M,), predicts."""
        predicted = self.tau_arm + self.regressor @ rho
        variances = self.noise.threshold**2 + (self.noise.weber_fraction * predicted) ** 2
        weighted = self.regressor.T / variances
        log_scale = float(np.log(2.0 * np.pi * variances).sum())
        log_constant = -0.5 * (float((self.residual**2 / variances).sum()) + log_scale)
        return Likelihood(
            weighted @ self.regressor, weighted @ self.residual, log_constant, -0.5 * log_scale, len(variances)
        )

    def find_likelihood(self, belief: DensityBelief) -> Likelihood:
        """Finds the likelihood of the densities, with errors evaluated at the posterior mean.

        The cost is a few products of (M, num_joints) matrices and a solve of M equations in each of about ten
        iterations.

        Args:
            belief: Belief about the densities before the measurement, of size M.
        """
        return find_fixed_point(belief, self.compute_likelihood)
