"""The payload regressor Y: torques of a held tool are linear in its inertial parameters.

    tau = tau_arm(q, v, vdot) + Y(q, v, vdot) pi          (from the paper's eq. 2; design 1)

By the Newton-Euler equations of the tool about To, with a the acceleration of To less gravity, alpha and w its
angular acceleration and velocity, all expressed in T:

    f = m a + alpha x (m p) + w x (w x (m p)),    n = (m p) x a + I alpha + w x I w

so the wrench is W pi with W of shape (6, 10), and Y = Jv_V_WT^T W. Order of pi: see inertia.py.
"""

import numpy as np
from numpy.typing import NDArray

from affordance.arm import ArmModel
from affordance.inertia import NUM_PARAMETERS
from affordance.kinematics import SerialChain

Array = NDArray[np.float64]


def compute_payload_regressor(model: ArmModel, x: Array, vdot: Array) -> Array:
    """Computes Y at one state, with Drake's kinematics.

    Args:
        model: The arm; its state is set to x.
        x: Joint angles and rates, shape (2 num_joints,), [rad, rad/s].
        vdot: Joint accelerations, shape (num_joints,), [rad/s^2].

    Returns: Y, shape (num_joints, 10).
    """
    model.set_state(x)
    J = model.compute_hand_jacobian()
    A_WT = J @ vdot + model.compute_hand_bias_acceleration()
    R_WT = model.compute_hand_pose().rotation().matrix()
    w = J[:3] @ x[len(vdot) :]
    vectors_W = np.array([A_WT[3:] - model.gravity, A_WT[:3], w])
    wrench = _wrench_regressor(*(vectors_W @ R_WT))
    return J[:3].T @ (R_WT @ wrench[:3]) + J[3:].T @ (R_WT @ wrench[3:])


def compute_payload_regressors(chain: SerialChain, q: Array, v: Array, vdot: Array) -> Array:
    """Computes Y along a trajectory, all samples at once.

    Args:
        chain: The arm's chain from W to T.
        q: Joint angles, shape (N, num_joints), [rad].
        v: Joint rates, shape (N, num_joints), [rad/s].
        vdot: Joint accelerations, shape (N, num_joints), [rad/s^2].

    Returns: Y, shape (N, num_joints, 10).
    """
    motion = chain.compute_motion(q, v, vdot)
    R_TW = motion.R_WT.transpose(0, 2, 1)
    vectors_W = np.stack([motion.a_WT - chain.gravity_W, motion.alpha_WT, motion.w_WT], axis=-1)
    a, alpha, w = np.moveaxis(R_TW @ vectors_W, -1, 0)
    wrench = _wrench_regressor(a, alpha, w)
    J_rotation = R_TW @ motion.Jv_V_WT[:, :3]
    J_translation = R_TW @ motion.Jv_V_WT[:, 3:]
    J = np.concatenate([J_rotation, J_translation], axis=1)
    return J.transpose(0, 2, 1) @ wrench


def _wrench_regressor(a: Array, alpha: Array, w: Array) -> Array:
    """Builds W with [n; f] = W pi, all in T; inputs of shape (..., 3), result of shape (..., 6, 10)."""
    W = np.zeros((*a.shape[:-1], 6, NUM_PARAMETERS))
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = alpha[..., 0], alpha[..., 1], alpha[..., 2]
    wx, wy, wz = w[..., 0], w[..., 1], w[..., 2]
    xx, yy, zz = wx * wx, wy * wy, wz * wz
    xy, xz, yz = wx * wy, wx * wz, wy * wz
    # Force: m a + ([alpha]x + [w]x [w]x) h, with h = m p.
    W[..., 3:, 0] = a
    W[..., 3, 1], W[..., 3, 2], W[..., 3, 3] = -yy - zz, xy - bz, xz + by
    W[..., 4, 1], W[..., 4, 2], W[..., 4, 3] = xy + bz, -xx - zz, yz - bx
    W[..., 5, 1], W[..., 5, 2], W[..., 5, 3] = xz - by, yz + bx, -xx - yy
    # Moment: h x a, then I alpha + w x (I w) in the order Ixx, Iyy, Izz, Ixy, Ixz, Iyz.
    W[..., 0, 2], W[..., 0, 3] = az, -ay
    W[..., 1, 1], W[..., 1, 3] = -az, ax
    W[..., 2, 1], W[..., 2, 2] = ay, -ax
    W[..., 0, 4], W[..., 0, 5], W[..., 0, 6] = bx, -yz, yz
    W[..., 1, 4], W[..., 1, 5], W[..., 1, 6] = xz, by, -xz
    W[..., 2, 4], W[..., 2, 5], W[..., 2, 6] = -xy, xy, bz
    W[..., 0, 7], W[..., 0, 8], W[..., 0, 9] = by - xz, bz + xy, yy - zz
    W[..., 1, 7], W[..., 1, 8], W[..., 1, 9] = bx + yz, zz - xx, bz - xy
    W[..., 2, 7], W[..., 2, 8], W[..., 2, 9] = xx - yy, bx - yz, by + xz
    return W
