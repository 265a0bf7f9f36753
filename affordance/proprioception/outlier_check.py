"""Plausibility check of torque samples.

A sample is rejected if it is missing, if it is not finite, or if no physically possible densities can explain the
torque at some joint. The check does not depend on the belief, because a surprising object is not a sensor fault.
"""

import enum

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import DENSITY_MAX, Geometry
from affordance.proprioception.torque_noise import NoiseModel

# A presentation with a smaller p-value under the prior is an outlier: one-sided 5 sigma, as for discoveries in
# physics.
OUTLIER_P_VALUE = 2.87e-7

# A torque is rejected if it exceeds the possible range by this many standard deviations of the noise. Without a
# fault, this happens once in 10^9 samples.
_MARGIN = 6.0


class SampleStatus(enum.Enum):
    """Status of a sample. The values are indices into the counts of a trial."""

    MISSING = 0
    NOT_FINITE = 1
    IMPOSSIBLE = 2
    ACCEPTED = 3


def check_reading(tau: Array) -> SampleStatus:
    """Checks that measured torques, (num_joints,), are finite. No model is needed."""
    finite = np.isfinite(tau)
    if finite.all():
        return SampleStatus.ACCEPTED
    return SampleStatus.NOT_FINITE if finite.any() or np.isinf(tau).any() else SampleStatus.MISSING


def check_torque(tau: Array, tau_arm: Array, Y: Array, geometry: Geometry, noise: NoiseModel) -> SampleStatus:
    """Checks if an object of this geometry could cause the measured torques.

    Args:
        tau: Measured torques, (num_joints,), [N m].
        tau_arm: Torques of the arm alone, (num_joints,), [N m].
        Y: Payload regressor, (num_joints, 10).
        geometry: Inertia map of the object.
        noise: Model of torque errors.

    Returns:
        ACCEPTED or IMPOSSIBLE.
    """
    heaviest = np.full(geometry.Phi.shape[1], DENSITY_MAX)
    loads = Y @ geometry.Phi * heaviest  # (num_joints, M)
    low = tau_arm + np.minimum(loads, 0.0).sum(axis=1)
    high = tau_arm + np.maximum(loads, 0.0).sum(axis=1)
    variance = noise.compute_sd(np.maximum(np.abs(low), np.abs(high))) ** 2
    if len(geometry.Phi_errors):
        variance += np.diag(Y @ geometry.compute_covariance(heaviest) @ Y.T)
    margin = _MARGIN * np.sqrt(variance)
    possible = (tau >= low - margin) & (tau <= high + margin)
    return SampleStatus.ACCEPTED if possible.all() else SampleStatus.IMPOSSIBLE
