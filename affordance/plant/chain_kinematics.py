"""Kinematics of a serial arm along whole trajectories, in NumPy, by outward recursion over the joints.

Drake computes one state per call; figures, heights and regressors need hundreds. The chain's constants are read once
from a Drake plant. Frames: W world, F a joint's frame on its parent, M its moving frame, T the end of the chain (the
tool).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array


class ChainMotion(NamedTuple):
    """Motion of T along a trajectory of N samples; vectors are expressed in W."""

    R_WT: Array  # (N, 3, 3)
    p_WT: Array  # (N, 3), [m]
    w_WT: Array  # (N, 3), [rad/s]
    alpha_WT: Array  # (N, 3), [rad/s^2]
    a_WT: Array  # (N, 3), [m/s^2]
    Jv_V_WT: Array  # (N, 6, num_joints), rotation first


@dataclass(frozen=True)
class SerialChain:
    """Revolute joints in series from W to T.

    Attributes:
        R_PF: Rotation of each joint's frame F, fixed to the parent, relative to the previous joint's moving frame
            (to W for the first), shape (num_joints, 3, 3).
        p_PF: Position of each joint's frame F relative to the same frame as R_PF, shape (num_joints, 3), [m].
        axes: Joint axes expressed in F, shape (num_joints, 3).
        R_MT: Rotation of T in the last joint's moving frame, shape (3, 3).
        p_MT: Position of T in the last joint's moving frame, shape (3,), [m].
        gravity_W: Gravitational acceleration in W, shape (3,), [m/s^2].
    """

    R_PF: Array
    p_PF: Array
    axes: Array
    R_MT: Array
    p_MT: Array
    gravity_W: Array

    @property
    def num_joints(self) -> int:
        """Number of joints."""
        return len(self.axes)

    def compute_motion(self, q: Array, v: Array, vdot: Array) -> ChainMotion:
        """Computes pose, velocity, acceleration and Jacobian of T by outward recursion.

        Args:
            q: Joint angles, shape (N, num_joints), [rad].
            v: Joint rates, shape (N, num_joints), [rad/s].
            vdot: Joint accelerations, shape (N, num_joints), [rad/s^2].

        Returns: Motion of T.
        """
        *_, last = self.compute_link_motions(q, v, vdot)
        p, a = self._step_along(*last[:5], self.p_MT)
        J = np.array(last.Jv_V_WT)
        J[:, 3:] += cross(J[:, :3].transpose(0, 2, 1), (p - last.p_WT)[:, None]).transpose(0, 2, 1)
        return last._replace(R_WT=last.R_WT @ self.R_MT, p_WT=p, a_WT=a, Jv_V_WT=J)

    def compute_link_motions(self, q: Array, v: Array, vdot: Array) -> Iterator[ChainMotion]:
        """Computes the motion of each link's frame M, the Jacobian by the joints up to it.

        Arguments as in ``compute_motion``.
        """
        num_samples = len(q)
        R = np.broadcast_to(np.eye(3), (num_samples, 3, 3))
        p, w, alpha, a = (np.zeros((num_samples, 3)) for _ in range(4))
        axes_W = np.empty((self.num_joints, num_samples, 3))
        origins_W = np.empty((self.num_joints, num_samples, 3))
        for j in range(self.num_joints):
            p, a = self._step_along(R, p, w, alpha, a, self.p_PF[j])
            R_WF = R @ self.R_PF[j]
            axis = R_WF @ self.axes[j]
            rate = v[:, j, None] * axis
            alpha = alpha + vdot[:, j, None] * axis + cross(w, rate)
            w = w + rate
            R = R_WF @ _rotation_about(self.axes[j], q[:, j])
            axes_W[j], origins_W[j] = axis, p
            J = np.empty((num_samples, 6, j + 1))
            J[:, :3] = axes_W[: j + 1].transpose(1, 2, 0)
            J[:, 3:] = cross(axes_W[: j + 1], p - origins_W[: j + 1]).transpose(1, 2, 0)
            yield ChainMotion(R, p, w, alpha, a, J)

    def compute_positions(self, q: Array, p_TQ: Array) -> Array:
        """Computes the positions in W of a point Q fixed to T along a trajectory.

        Args:
            q: Joint angles, shape (N, num_joints), [rad].
            p_TQ: Position of Q in T, shape (3,), [m].

        Returns: Positions p_WQ, shape (N, 3), [m].
        """
        R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        p = np.zeros((len(q), 3))
        for j in range(self.num_joints):
            p = p + R @ self.p_PF[j]
            R = R @ self.R_PF[j] @ _rotation_about(self.axes[j], q[:, j])
        return p + R @ (self.p_MT + self.R_MT @ p_TQ)

    @staticmethod
    def _step_along(R: Array, p: Array, w: Array, alpha: Array, a: Array, offset: Array) -> tuple[Array, Array]:
        """Computes position and acceleration of a point at a fixed offset on the same body."""
        if not offset.any():
            return p, a
        r = R @ offset
        return p + r, a + cross(alpha, r) + cross(w, cross(w, r))


def _rotation_about(axis: Array, angles: Array) -> Array:
    """Computes rotation matrices about a fixed unit axis by N angles (Rodrigues), shape (N, 3, 3)."""
    K, K2 = _build_generator(*axis.tolist())
    R: Array = np.eye(3) + np.sin(angles)[:, None, None] * K + (1.0 - np.cos(angles))[:, None, None] * K2
    return R


@lru_cache(maxsize=64)
def _build_generator(x: float, y: float, z: float) -> tuple[Array, Array]:
    """Builds the matrix of the cross product with an axis, and its square, (3, 3) each."""
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return K, K @ K


def cross(a: Array, b: Array) -> Array:
    """Computes the cross product along the last axis, several times faster than numpy.cross on small arrays."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    first = ay * bz - az * by
    found = np.empty((*first.shape, 3))
    found[..., 0], found[..., 1], found[..., 2] = first, az * bx - ax * bz, ax * by - ay * bx
    return found
