"""How wrongly joint accelerations are felt.

The paper takes them for felt as they are. An error of them is one of the estimator too: it multiplies the whole
mass matrix, arm included, and the estimator takes what it feels for exact (docs/decisions/0027-robustness.md).
"""

import numpy as np

from affordance.arrays import Array
from affordance.random_streams import Stream


def draw_acceleration_error(sd: float, seed: tuple[int, ...], num_joints: int) -> Array:
    """Draws the error of a trial, which lasts as long as it does, (num_joints,), [rad/s^2]; zero if sd is."""
    if sd == 0.0:
        return np.zeros(num_joints)
    return sd * np.random.default_rng((*seed, Stream.ACCELERATION)).standard_normal(num_joints)
