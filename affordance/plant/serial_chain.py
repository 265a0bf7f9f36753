"""Kinematics and dynamics of a serial arm along whole trajectories, in NumPy.

Drake computes one state per call, but figures, heights, regressors and identification need hundreds of states. All
constants are read from a Drake plant (``chain_plant``). Frames: W the world or a robot's base, F a joint's frame on
its parent, M the joint's moving frame, T the end of the chain (the tool, or the tip to which a payload is fixed).
"""

import functools
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS

_ALL = np.eye(NUM_PARAMETERS)
# Step to which an arm's parameters are rounded for its fingerprint. Files contain decimal numbers, so the offset
# moves the rounding thresholds away from them.
_FINGERPRINT_STEP, _FINGERPRINT_EDGE = 1e-6, 1.0 / np.pi


class ChainMotion(NamedTuple):
    """Motion of T along a trajectory of N samples. All vectors are in W."""

    R_WT: Array  # (N, 3, 3)
    p_WT: Array  # (N, 3), [m]
    w_WT: Array  # (N, 3), [rad/s]
    alpha_WT: Array  # (N, 3), [rad/s^2]
    a_WT: Array  # (N, 3), [m/s^2]
    Jv_V_WT: Array  # (N, 6, num_joints), rotation first


class ChainDynamics(NamedTuple):
    """Torques of the arm, and payload regressors at T, along a trajectory of N samples."""

    motion: ChainMotion
    arm_torques: Array  # torques of the arm alone, shape (N, num_joints), [N m]
    Y: Array  # payload regressors, shape (N, num_joints, 10)


class _LinkMotion(NamedTuple):
    """Motion of a link's frame M, with axes and origins of all joints up to the link."""

    R: Array  # (N, 3, 3)
    p: Array  # (N, 3)
    w: Array  # (N, 3)
    alpha: Array  # (N, 3)
    a: Array  # (N, 3)
    axes_W: Array  # (joints up to the link, N, 3)
    origins_W: Array  # (joints up to the link, N, 3)

    def build(self) -> ChainMotion:
        """Computes the Jacobian from joint axes and origins, and adds it to the motion."""
        joints, num_samples, _ = self.axes_W.shape
        J = np.empty((num_samples, 6, joints))
        J[:, :3] = self.axes_W.transpose(1, 2, 0)
        J[:, 3:] = cross(self.axes_W, self.p - self.origins_W).transpose(1, 2, 0)
        return ChainMotion(*self[:5], J)


@dataclass(frozen=True)
class SerialChain:
    """Serial arm with revolute joints and rigid links from W to T.

    A trajectory of N samples has joint angles q, velocities v and accelerations vdot, each of shape (N, num_joints),
    [rad], [rad/s], [rad/s^2].
    """

    source: str  # file of the robot, for messages
    joint_names: tuple[str, ...]  # names of the joints from base to tip
    tip: str  # name of the frame T
    # Rotation of each joint's frame F in its parent frame P, shape (num_joints, 3, 3). P is the moving frame of the
    # previous joint; W for the first joint.
    R_PF: Array
    p_PF: Array  # position of each joint's frame F in P, shape (num_joints, 3), [m]
    axes: Array  # joint axes expressed in F, shape (num_joints, 3)
    R_MT: Array  # rotation of T in the last joint's moving frame, shape (3, 3)
    p_MT: Array  # position of T in the last joint's moving frame, shape (3,), [m]
    gravity_W: Array  # gravitational acceleration in W, shape (3,), [m/s^2]
    # Ten inertial parameters of each link about Mo, expressed in M, shape (num_joints, 10). A link includes all
    # bodies fixed to it, except the tool.
    link_parameters: Array
    # Joint limits in the file; infinite if there are none.
    limits: Array  # lower and upper position limits, shape (2, num_joints), [rad]
    velocity_limits: Array  # shape (num_joints,), [rad/s]
    acceleration_limits: Array  # shape (num_joints,), [rad/s^2]

    def __repr__(self) -> str:
        return f"SerialChain({self.source} to {self.tip}: {', '.join(self.joint_names)})"

    @property
    def num_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def fingerprint(self) -> str:
        """Text that identifies the arm, regardless of file name, mounting and tip."""
        digest = hashlib.sha256(" ".join(self.joint_names).encode())
        for part in (self.R_PF, self.p_PF, self.axes, self.link_parameters):
            digest.update(np.floor(part / _FINGERPRINT_STEP + _FINGERPRINT_EDGE).astype(np.int64).tobytes())
        return digest.hexdigest()[:12]

    def with_gravity(self, gravity_W: Sequence[float] | Array) -> "SerialChain":
        """Returns the same arm with another gravity vector in its base frame, (3,), [m/s^2]."""
        return replace(self, gravity_W=np.array(gravity_W, dtype=float))

    def compute_motion(self, q: Array, v: Array, vdot: Array) -> ChainMotion:
        """Computes pose, velocity, acceleration and Jacobian of T by outward recursion."""
        *_, last = self._follow_links(q, v, vdot)
        return self._move_to_tip(last.build())

    def compute_dynamics(self, q: Array, v: Array, vdot: Array) -> ChainDynamics:
        """Computes arm torques and payload regressors in a single recursion along the arm."""
        torques = np.zeros_like(q)
        for link, motion in enumerate(self.compute_link_motions(q, v, vdot)):
            self._add_torques(torques, link, motion)
        at_tip = self._move_to_tip(motion)
        return ChainDynamics(at_tip, torques, self._compute_regressors(at_tip))

    def _move_to_tip(self, last: ChainMotion) -> ChainMotion:
        """Computes the motion of T from the motion of the last link."""
        p, a = _step_along(*last[:5], self.p_MT)
        J = np.array(last.Jv_V_WT)
        J[:, 3:] += cross(J[:, :3].transpose(0, 2, 1), (p - last.p_WT)[:, None]).transpose(0, 2, 1)
        return last._replace(R_WT=last.R_WT @ self.R_MT, p_WT=p, a_WT=a, Jv_V_WT=J)

    def compute_link_motions(self, q: Array, v: Array, vdot: Array) -> Iterator[ChainMotion]:
        """Computes the motion of each link's frame M. Its Jacobian has a column for each joint up to the link."""
        for link in self._follow_links(q, v, vdot):
            yield link.build()

    def _follow_links(self, q: Array, v: Array, vdot: Array) -> Iterator[_LinkMotion]:
        """Computes the motion of each link's frame M by outward recursion."""
        num_samples = len(q)
        R = np.broadcast_to(np.eye(3), (num_samples, 3, 3))
        p, w, alpha, a = (np.zeros((num_samples, 3)) for _ in range(4))
        axes_W = np.empty((self.num_joints, num_samples, 3))
        origins_W = np.empty((self.num_joints, num_samples, 3))
        for j in range(self.num_joints):
            p, a = _step_along(R, p, w, alpha, a, self.p_PF[j])
            R_WF = R @ self.R_PF[j]
            axis = R_WF @ self.axes[j]
            rate = v[:, j, None] * axis
            alpha = alpha + vdot[:, j, None] * axis + cross(w, rate)
            w = w + rate
            R = R_WF @ _rotation_about(self.axes[j], q[:, j])
            axes_W[j], origins_W[j] = axis, p
            yield _LinkMotion(R, p, w, alpha, a, axes_W[: j + 1], origins_W[: j + 1])

    def compute_positions(self, q: Array, p_TQ: Array) -> Array:
        """Computes the positions in W, (N, 3), [m], of a point Q fixed to T.

        Args:
            q: Joint angles, (N, num_joints), [rad].
            p_TQ: Position of Q in T, (3,), [m].
        """
        return self.compute_positions_of(q, [p_TQ])[0]

    def compute_positions_of(self, q: Array, points: Sequence[Array]) -> list[Array]:
        """Computes the positions in W, (N, 3) each, [m], of several points fixed to T.

        Args:
            q: Joint angles, (N, num_joints), [rad].
            points: Positions of the points in T, (3,) each, [m].
        """
        R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        p = np.zeros((len(q), 3))
        for j in range(self.num_joints):
            p = p + R @ self.p_PF[j]
            R = R @ self.R_PF[j] @ _rotation_about(self.axes[j], q[:, j])
        return [p + R @ (self.p_MT + self.R_MT @ p_TQ) for p_TQ in points]

    def compute_payload_regressors(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes the payload regressors Y along a trajectory, shape (N, num_joints, 10)."""
        return self._compute_regressors(self.compute_motion(q, v, vdot))

    def compute_wrench_regressors(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes wrench regressors W along a trajectory, (N, 6, 10).

        The payload's moment n about To and its force f, expressed in T, are [n; f] = W pi.
        """
        return self._compute_wrench(self.compute_motion(q, v, vdot))

    def compute_link_regressors(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes the torque regressors of the links' inertial parameters, (N, num_joints, 10 num_joints)."""
        regressors = np.zeros((*q.shape, self.num_joints, NUM_PARAMETERS))
        for link, motion in enumerate(self.compute_link_motions(q, v, vdot)):
            regressors[:, : link + 1, link] = self._compute_regressors(motion)
        return regressors.reshape(*q.shape, -1)

    def compute_arm_torques(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes the torques of the arm without a payload, shape (N, num_joints), [N m]."""
        torques = np.zeros_like(q)
        for link, motion in enumerate(self.compute_link_motions(q, v, vdot)):
            self._add_torques(torques, link, motion)
        return torques

    def _add_torques(self, torques: Array, link: int, motion: ChainMotion) -> None:
        """Adds the torques due to one link to all joints up to this link."""
        column = self.link_parameters[link, :, None]
        torques[:, : link + 1] += self._compute_regressors(motion, column)[..., 0]

    def _compute_regressors(self, motion: ChainMotion, columns: Array = _ALL) -> Array:
        """Computes the torque regressors of a body, times ``columns``, (10, K), as an array (N, joints, K)."""
        wrench = self._compute_wrench(motion) @ columns
        wrench_W = motion.R_WT[:, None] @ wrench.reshape(len(wrench), 2, 3, -1)
        Y: Array = motion.Jv_V_WT.transpose(0, 2, 1) @ wrench_W.reshape(len(wrench), 6, -1)
        return Y

    def _compute_wrench(self, motion: ChainMotion) -> Array:
        motion_W = np.stack([motion.a_WT - self.gravity_W, motion.alpha_WT, motion.w_WT], axis=1)  # (N, 3, 3)
        return compute_wrench_regressor(motion_W @ motion.R_WT)  # (N, 6, 10)


@runtime_checkable
class ArmOwner(Protocol):
    """Object that has an arm, such as a ``Robot``."""

    @property
    def directives(self) -> Path:
        """Drake's model directives file of the arm."""

    @property
    def chain(self) -> SerialChain:
        """Chain of joints and links up to the hand."""


def _step_along(R: Array, p: Array, w: Array, alpha: Array, a: Array, offset: Array) -> tuple[Array, Array]:
    """Computes position and acceleration of a point at a fixed offset in the same body."""
    if not offset.any():
        return p, a
    r = R @ offset
    return p + r, a + cross(alpha, r) + cross(w, cross(w, r))


def _rotation_about(axis: Array, angles: Array) -> Array:
    """Computes rotation matrices, (N, 3, 3), for N angles about a fixed unit axis (Rodrigues)."""
    K, K2 = _build_generator(*axis.tolist())
    R: Array = np.eye(3) + np.sin(angles)[:, None, None] * K + (1.0 - np.cos(angles))[:, None, None] * K2
    return R


@functools.lru_cache(maxsize=64)
def _build_generator(x: float, y: float, z: float) -> tuple[Array, Array]:
    """Builds the cross-product matrix of an axis, and the square of this matrix, (3, 3) each."""
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return K, K @ K


def cross(a: Array, b: Array) -> Array:
    """Computes the cross product along the last axis. On small arrays it is several times faster than numpy.cross."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    first = ay * bz - az * by
    found = np.empty((*first.shape, 3))
    found[..., 0], found[..., 1], found[..., 2] = first, az * bx - ax * bz, ax * by - ay * bx
    return found


def compute_wrench_regressor(motion: Array) -> Array:
    """Computes wrench regressors W, (..., 6, 10), with [n; f] = W pi.

    Args:
        motion: Rows a (relative to gravity), alpha and w, expressed in T, (..., 3, 3).
    """
    w = motion[..., 2, :]
    linear = np.concatenate([motion[..., 0, :], motion[..., 1, :], w[..., _FIRST] * w[..., _SECOND]], axis=-1)
    W: Array = (linear @ _WRENCH_MAP).reshape(*motion.shape[:-2], 6, NUM_PARAMETERS)
    return W


def _build_wrench_regressor(linear: Array) -> Array:
    """Builds W from twelve numbers: a, alpha and the products wx wx, wy wy, wz wz, wx wy, wx wz, wy wz."""
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


# Indices of the factors in the products of w's components, in the order above.
_FIRST, _SECOND = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
# W is linear in the twelve numbers, so that one product with this matrix, (12, 60), builds it for all samples.
_WRENCH_MAP = np.array([_build_wrench_regressor(unit).ravel() for unit in np.eye(12)])
