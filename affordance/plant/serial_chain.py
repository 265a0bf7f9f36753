"""Kinematics of a serial arm along whole trajectories at once, in NumPy.

Drake computes one state a call; figures, heights and regressors want hundreds. The chain's constants are read from
a Drake plant once. Frames: W world, T the frame at the end of the chain (the tool).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import Frame, Joint, RevoluteJoint
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.exceptions import ModelFileError
from affordance.plant.arm import Arm


class ChainMotion(NamedTuple):
    """Motion of T along a trajectory of N samples; vectors are expressed in W unless said otherwise."""

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
        p_PF: Position of the same, shape (num_joints, 3), [m].
        axes: Joint axes expressed in F, shape (num_joints, 3).
        R_MT: Rotation of T in the last joint's moving frame, shape (3, 3).
        p_MT: Position of the same, shape (3,), [m].
        gravity_W: Acceleration of gravity in W, shape (3,), [m/s^2].
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

        Returns: The motion of T.
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
            alpha = alpha + vdot[:, j, None] * axis + _cross(w, rate)
            w = w + rate
            R = R_WF @ _rotation_about(self.axes[j], q[:, j])
            axes_W[j], origins_W[j] = axis, p
        p, a = self._step_along(R, p, w, alpha, a, self.p_MT)
        J = np.empty((num_samples, 6, self.num_joints))
        J[:, :3] = axes_W.transpose(1, 2, 0)
        J[:, 3:] = _cross(axes_W, p - origins_W).transpose(1, 2, 0)
        return ChainMotion(R @ self.R_MT, p, w, alpha, a, J)

    def compute_positions(self, q: Array, p_TQ: Array) -> Array:
        """Computes where a point Q fixed to T is in W along a trajectory.

        Args:
            q: Joint angles, shape (N, num_joints), [rad].
            p_TQ: The point, shape (3,), [m].

        Returns: p_WQ, shape (N, 3), [m].
        """
        R = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        p = np.zeros((len(q), 3))
        for j in range(self.num_joints):
            p = p + R @ self.p_PF[j]
            R = R @ self.R_PF[j] @ _rotation_about(self.axes[j], q[:, j])
        return p + R @ (self.p_MT + self.R_MT @ p_TQ)

    @staticmethod
    def _step_along(R: Array, p: Array, w: Array, alpha: Array, a: Array, offset: Array) -> tuple[Array, Array]:
        """Moves position and acceleration to a point at a fixed offset on the same body."""
        if not offset.any():
            return p, a
        r = R @ offset
        return p + r, a + _cross(alpha, r) + _cross(w, _cross(w, r))


def build_chain(arm: Arm) -> SerialChain:
    """Reads the constants of the chain from W to the tool from a Drake plant.

    Raises:
        ModelFileError: The joints are not revolute or do not lie one after the other.
    """
    plant = arm.plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.zeros(arm.num_joints))
    joints: list[Joint] = [plant.get_joint(index) for index in plant.GetJointIndices()]
    moving = sorted((joint for joint in joints if joint.num_velocities() > 0), key=Joint.velocity_start)
    rotations, positions, axes = [], [], []
    previous: Frame = plant.world_frame()
    for joint in moving:
        if not isinstance(joint, RevoluteJoint):
            raise ModelFileError(arm.source, f"has joint {joint.name()}, which is not revolute as all must be")
        X_PF = joint.frame_on_parent().CalcPose(context, previous)
        rotations.append(X_PF.rotation().matrix())
        positions.append(X_PF.translation())
        axes.append(joint.revolute_axis())
        previous = joint.frame_on_child()
    X_MT = arm.tool.body_frame().CalcPose(context, previous)
    chain = SerialChain(
        np.array(rotations),
        np.array(positions),
        np.array(axes),
        X_MT.rotation().matrix(),
        X_MT.translation(),
        plant.gravity_field().gravity_vector(),
    )
    _check_against_plant(chain, arm, context)
    return chain


def _check_against_plant(chain: SerialChain, arm: Arm, context: Context) -> None:
    """Refuses plants whose joints branch: a point of the tool would then not be where the chain says."""
    p_TQ = np.array([0.1, 0.2, 0.3])
    q = np.linspace(0.1, 1.0, arm.num_joints)
    arm.plant.SetPositions(context, q)
    p_WQ = arm.tool.body_frame().CalcPoseInWorld(context) @ p_TQ
    if not np.allclose(chain.compute_positions(q[None], p_TQ)[0], p_WQ, rtol=0.0, atol=1e-9):
        raise ModelFileError(arm.source, "has joints that do not lie one after the other from base to hand")


def _rotation_about(axis: Array, angles: Array) -> Array:
    """Rotation matrices about a fixed unit axis by N angles (Rodrigues), shape (N, 3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    R: Array = np.eye(3) + np.sin(angles)[:, None, None] * K + (1.0 - np.cos(angles))[:, None, None] * (K @ K)
    return R


def _cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; several times faster than numpy.cross on small arrays."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
