"""Measurement errors of joint accelerations.

The paper assumes exact accelerations. Their error also affects the estimator, which takes measured accelerations
for exact: it multiplies the whole mass matrix, arm included (docs/decisions/0027-robustness.md).
"""

import numpy as np

from affordance.arrays import Array
from affordance.runs.random_streams import Stream


def draw_acceleration_error(sd: float, seed: tuple[int, ...], num_joints: int) -> Array:
    """Draws the error of a trial, constant within it, shape (num_joints,), [rad/s^2]; zero if sd is zero."""
    if sd == 0.0:
        return np.zeros(num_joints)
    return sd * np.random.default_rng((*seed, Stream.ACCELERATION)).standard_normal(num_joints)
