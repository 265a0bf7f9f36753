"""Measured torques of an object held still, without simulating it: for studies of the estimator by the thousand.

The arm rests in one posture, so the percept is the mean torque of a hold in which nothing moves.
"""

import numpy as np

from affordance.arrays import Array
from affordance.belief.object_belief import ObjectBelief
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.payload_regressor import compute_payload_regressor
from affordance.proprioception.acceleration_error import draw_acceleration_error
from affordance.proprioception.estimator import TorqueStatistics
from affordance.proprioception.torque_noise import NoiseModel


class StaticHold:
    """The arm at rest in a posture.

    Attributes:
        Y: Payload regressor, shape (num_joints, 10).
        tau_arm: Torque of the arm alone, shape (num_joints,), [N m].
    """

    def __init__(self, arm: Arm, q: Array | None = None) -> None:
        """Computes regressor and torque once, in a posture q, (num_joints,), [rad]; the arm's home if None."""
        model = ArmModel(arm)
        at_rest = np.zeros(arm.num_joints)
        posture = arm.home if q is None else q
        x = np.concatenate([posture, at_rest])
        self.Y = compute_payload_regressor(model, x, at_rest)
        self.tau_arm = model.compute_inverse_dynamics(at_rest)
        # What a unit acceleration of each joint adds to both.
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
        """Draws the measured torques of an object.

        Args:
            belief: Gives the object's geometry.
            rho: Its true densities, in the order of the belief, shape (M,), [kg/m^3].
            noise: How well joints feel.
            seed: Determines all errors.
            num_samples: How many samples of a trial, each with the errors of its own; None for one sample whose only
                errors are those of the trial.
            acceleration_sd: Standard deviation of the error of a felt joint acceleration, which lasts the trial,
                [rad/s^2].

        Returns: Their statistics.
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
            if error is None:  # all samples are alike
                return TorqueStatistics(noise.compute_features(felt, tau_arm, Y), num_samples)
            statistics = statistics.add(noise.compute_features(felt + error, tau_arm, Y))
        return statistics
