"""Plausibility check of torque samples.

A sample is rejected if it did not arrive, is not finite, or if no possible densities explain a joint's torque.
The belief plays no part: a surprising object is not a broken sensor.
"""

import enum

import numpy as np

from affordance.arrays import Array
from affordance.objects.geometry import Geometry
from affordance.objects.tool import DENSITY_MAX
from affordance.proprioception.torque_noise import NoiseModel

# A torque beyond the possible by this many standard deviations of noise is rejected: one in 10^9 without fault.
_MARGIN = 6.0


class SampleStatus(enum.Enum):
    """What became of a sample; the values are places in the counts of a trial."""

    MISSING = 0
    NOT_FINITE = 1
    IMPOSSIBLE = 2
    ACCEPTED = 3


def check_reading(tau: Array) -> SampleStatus:
    """Judges measured torques, shape (num_joints,), by themselves: ACCEPTED if they are finite."""
    finite = np.isfinite(tau)
    if finite.all():
        return SampleStatus.ACCEPTED
    return SampleStatus.NOT_FINITE if finite.any() or np.isinf(tau).any() else SampleStatus.MISSING


def check_torque(tau: Array, tau_arm: Array, Y: Array, geometry: Geometry, noise: NoiseModel) -> SampleStatus:
    """Judges finite torques by whether an object of this geometry could load the arm with them.

    Args:
        tau: Measured torques, shape (num_joints,), [N m].
        tau_arm: Torques of the arm alone, shape (num_joints,), [N m].
        Y: Payload regressor, shape (num_joints, 10).
        geometry: Of the object, with its uncertainty.
        noise: Errors of measured torques.

    Returns: ACCEPTED or IMPOSSIBLE.
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
