"""Wrench regressor: the wrench on a held body is linear in its inertial parameters, and so are joint torques.

The Newton-Euler equations of the tool about To are (Atkeson, An & Hollerbach 1986, Int. J. Robotics Research 5:101,
from memory), with a the acceleration of To minus gravity, and alpha and w the tool's angular acceleration and
velocity, all expressed in T:

    f = m a + alpha x (m p) + w x (w x (m p)),    n = (m p) x a + I alpha + w x I w

so the wrench is W pi with W of shape (6, 10), and Y = Jv_V_WT^T W. Order of pi: see inertia.py.
"""

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS


def compute_wrench_regressor(motion: Array) -> Array:
    """Computes W, (..., 6, 10), with [n; f] = W pi, from the rows a, alpha and w, (..., 3, 3), all in T."""
    w = motion[..., 2, :]
    linear = np.concatenate([motion[..., 0, :], motion[..., 1, :], w[..., _FIRST] * w[..., _SECOND]], axis=-1)
    W: Array = (linear @ _WRENCH_MAP).reshape(*motion.shape[:-2], 6, NUM_PARAMETERS)
    return W


def _build_wrench_regressor(linear: Array) -> Array:
    """Builds W, which is linear in a, alpha and the products wx wx, wy wy, wz wz, wx wy, wx wz, wy wz."""
    ax, ay, az, bx, by, bz, xx, yy, zz, xy, xz, yz = linear
    W = np.zeros((6, NUM_PARAMETERS))
    # Moment n: h x a with h = m p, then I alpha + w x (I w) in the order Ixx, Iyy, Izz, Ixy, Ixz, Iyz.
    W[:3, 1:4] = [[0, az, -ay], [-az, 0, ax], [ay, -ax, 0]]
    W[:3, 4:7] = [[bx, -yz, yz], [xz, by, -xz], [-xy, xy, bz]]
    W[:3, 7:] = [[by - xz, bz + xy, yy - zz], [bx + yz, zz - xx, bz - xy], [xx - yy, bx - yz, by + xz]]
    # Force f: m a + ([alpha]x + [w]x [w]x) h.
    W[3:, 0] = [ax, ay, az]
    W[3:, 1:4] = [[-yy - zz, xy - bz, xz + by], [xy + bz, -xx - zz, yz - bx], [xz - by, yz + bx, -xx - yy]]
    return W


# Index pairs of the products of w's components, in the order above.
_FIRST, _SECOND = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
# W is linear in twelve numbers: one matrix product builds it for any number of samples, (12, 60).
_WRENCH_MAP = np.array([_build_wrench_regressor(unit).ravel() for unit in np.eye(12)])
