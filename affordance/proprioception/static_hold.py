"""Measured torques of an object held still, without simulation, for studies with thousands of holds.

The arm rests in one posture, so the measurement is the mean torque of a hold without motion: tau = tau_arm + Y pi
with constant tau_arm and Y (paper, eq. 2 at rest).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals
from affordance.belief.object_belief import ObjectBelief
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.fixed_point import find_fixed_points
from affordance.proprioception.torque_noise import NoiseModel, WeberNoise, draw_acceleration_error


class StaticHold:
    """Arm that is held at rest in a posture."""

    def __init__(self, arm: Arm, q: Array | None = None) -> None:
        """Computes regressor and torque in a posture q, shape (num_joints,), [rad]; None for the arm's home."""
        model = ArmModel(arm)
        at_rest = np.zeros(arm.num_joints)
        posture = arm.home if q is None else q
        x = np.concatenate([posture, at_rest])
        self.Y = compute_payload_regressor(model, x, at_rest)  # (num_joints, 10)
        self.tau_arm = model.compute_inverse_dynamics(at_rest)  # torque of the arm alone, (num_joints,), [N m]
        # Changes of both for a unit acceleration of each joint.
        units = np.eye(len(posture))
        self._Y_per_vdot = np.array([compute_payload_regressor(model, x, unit) - self.Y for unit in units])
        self._tau_arm_per_vdot = np.array([model.compute_inverse_dynamics(unit) - self.tau_arm for unit in units])

    def measure(
        self,
        belief: ObjectBelief,
        rho: Array,
        noise: NoiseModel,
        seed: tuple[int, ...],
        *,
        num_samples: int | None = None,
        acceleration_sd: float = 0.0,
    ) -> TorqueStatistics:
        """Draws the measured torques of an object with the given densities.

        The seed determines all errors, including that of the joint acceleration.

        Args:
            belief: Belief whose geometry the object has.
            rho: True densities, (M,), [kg/m^3], in the order of the belief.
            noise: Model of the torque errors.
            seed: Seed of the errors.
            num_samples: Number of samples, each with errors of its own; None for one sample that has only the errors
                that last the trial.
            acceleration_sd: Standard deviation of the error of the measured joint acceleration, which lasts the
                trial, [rad/s^2].
        """
        tau = self.tau_arm + self.Y @ belief.compute_parameters(rho)
        gain, offset = noise.draw_trial_errors(seed, len(tau))
        felt = tau * (1.0 + gain) + offset
        tau_arm, Y = self.tau_arm, self.Y
        if acceleration_sd:
            vdot = draw_acceleration_error(acceleration_sd, seed, len(tau))
            tau_arm = tau_arm + vdot @ self._tau_arm_per_vdot
            Y = Y + np.einsum("j,jik->ik", vdot, self._Y_per_vdot)
        if num_samples is None:
            return TorqueStatistics(noise.compute_features(felt, tau_arm, Y), 1)
        statistics = TorqueStatistics(np.zeros(noise.num_features(len(tau))), 0)
        for sample in range(num_samples):
            error = noise.draw_sample_error((*seed, sample), tau)
            if error is None:  # all samples are the same
                return TorqueStatistics(noise.compute_features(felt, tau_arm, Y), num_samples)
            statistics = statistics.add(noise.compute_features(felt + error, tau_arm, Y))
        return statistics


class StaticPercept(NamedTuple):
    """Measured torques at rest of one object for each of B observers, at a small part of the estimator's cost.

    The likelihood equals that of ``WeberNoise`` for an arm at rest and an object of exact geometry: errors are then
    independent between joints, and no matrix is factorised.
    """

    tau_arm: Array  # torque of the arm alone, shape (num_joints,), [N m]
    regressor: Array  # torque per density, Y Phi, shape (B, num_joints, M), [N m / (kg/m^3)]
    residual: Array  # measured torque minus that of the arm alone, shape (B, num_joints), [N m]
    noise: WeberNoise  # errors of measured torques

    def compute_likelihood(self, rho: Array, observers: NDArray[np.intp]) -> Likelihood:
        """Computes the likelihood of the densities, with errors evaluated at the torque that rho, (N, M), predicts.

        ``observers`` has the number of each row's observer, (N,).
        """
        regressor, residual = self.regressor[observers], self.residual[observers]
        predicted = self.tau_arm + np.matvec(regressor, rho)
        variances = self.noise.threshold**2 + (self.noise.weber_fraction * predicted) ** 2
        weighted = np.swapaxes(regressor / variances[..., None], 1, 2)
        log_scale = np.log(2.0 * np.pi * variances).sum(axis=1)
        log_constant = -0.5 * ((residual**2 / variances).sum(axis=1) + log_scale)
        precision, information_vector = weighted @ regressor, np.matvec(weighted, residual)
        return Likelihood(precision, information_vector, log_constant, -0.5 * log_scale, len(self.tau_arm))

    def find_likelihood(self, normals: Normals, observers: NDArray[np.intp] | None = None) -> Likelihood:
        """Finds the likelihood with errors evaluated at the posterior mean of beliefs about M densities."""
        everyone = np.arange(len(normals)) if observers is None else observers
        return find_fixed_points(normals, everyone, self.compute_likelihood)
