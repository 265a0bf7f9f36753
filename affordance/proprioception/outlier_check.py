"""Plausibility check of torque samples.

A sample is rejected if it did not arrive, is not finite, or cannot be explained at some joint by any possible
densities. The belief is not used: a surprising object is not a broken sensor.
"""

import enum

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import DENSITY_MAX, Geometry
from affordance.proprioception.torque_noise import NoiseModel

# A presentation that is less probable than this, given the belief before it, is a one-sided 5-sigma outlier, the
# threshold for a discovery in physics.
OUTLIER_P_VALUE = 2.87e-7

# Number of noise standard deviations by which a rejected torque exceeds the possible range; without a fault this
# happens once in 10^9.
_MARGIN = 6.0


class SampleStatus(enum.Enum):
    """Status of a sample. The values are indices into the counts of a trial."""

    MISSING = 0
    NOT_FINITE = 1
    IMPOSSIBLE = 2
    ACCEPTED = 3


def check_reading(tau: Array) -> SampleStatus:
    """Checks measured torques, (num_joints,), without a model. Returns ACCEPTED if all are finite."""
    finite = np.isfinite(tau)
    if finite.all():
        return SampleStatus.ACCEPTED
    return SampleStatus.NOT_FINITE if finite.any() or np.isinf(tau).any() else SampleStatus.MISSING


def check_torque(tau: Array, tau_arm: Array, Y: Array, geometry: Geometry, noise: NoiseModel) -> SampleStatus:
    """Checks if an object of this geometry could cause measured torques. Returns ACCEPTED or IMPOSSIBLE.

    Measured torques and the arm's own torques are (num_joints,), [N m]; the payload regressor Y is (num_joints, 10).
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
