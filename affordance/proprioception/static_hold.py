"""Measured torques of an object held still, without simulating it: for studies of the estimator by the thousand.

The arm rests in one posture, so the percept is the mean torque of a hold in which nothing moves.
"""

import numpy as np

from affordance.arrays import Array
from affordance.belief.object_belief import ObjectBelief
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.payload_regressor import compute_payload_regressor
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
        self.Y = compute_payload_regressor(model, np.concatenate([posture, at_rest]), at_rest)
        self.tau_arm = model.compute_inverse_dynamics(at_rest)

    def measure(self, belief: ObjectBelief, rho: Array, noise: NoiseModel, seed: tuple[int, ...]) -> TorqueStatistics:
        """Draws the measured torques of an object.

        Args:
            belief: Gives the object's geometry.
            rho: Its true densities, in the order of the belief, shape (M,), [kg/m^3].
            noise: How well joints feel.
            seed: Determines the errors of the trial; errors of single samples are left out.

        Returns: Their statistics, of one sample.
        """
        tau = self.tau_arm + self.Y @ belief.compute_parameters(rho)
        gain, offset = noise.draw_trial_errors(seed, len(tau))
        features = noise.compute_features(tau * (1.0 + gain) + offset, self.tau_arm, self.Y)
        return TorqueStatistics(features, 1)
