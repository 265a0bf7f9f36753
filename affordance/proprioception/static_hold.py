"""Simulates the torques of an object held still, for studies with thousands of holds.

The arm rests in one posture, so the mean torque is tau = tau_arm + Y pi with constant tau_arm and Y (paper, eq. 2).
"""

import numpy as np

from affordance.arrays import Array
from affordance.belief.object_belief import ObjectBelief
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.torque_noise import NoiseModel, draw_acceleration_error


class StaticHold:
    """Arm at rest in a posture."""

    def __init__(self, arm: Arm, q: Array | None = None) -> None:
        """Computes the regressor and the torque of the arm alone in a posture q, (num_joints,), [rad].

        The default is the home posture.
        """
        model = ArmModel(arm)
        at_rest = np.zeros(arm.num_joints)
        posture = arm.home if q is None else q
        x = np.concatenate([posture, at_rest])
        self.Y = compute_payload_regressor(model, x, at_rest)  # (num_joints, 10)
        self.tau_arm = model.compute_inverse_dynamics(at_rest)  # torque of the arm alone, (num_joints,), [N m]
        # Changes of Y and tau_arm for a unit acceleration of each joint.
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

        Args:
            belief: Belief with the geometry of the object.
            rho: True densities, (M,), [kg/m^3], in the order of the belief.
            noise: Model of torque errors.
            seed: Seed of all errors.
            num_samples: Number of samples with their own errors; None for one sample with only the trial's errors.
            acceleration_sd: Standard deviation of the acceleration error, which is constant during the trial,
                [rad/s^2].
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
