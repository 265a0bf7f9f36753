"""Arm model of identification: a chain of revolute joints with the inertial parameters of its links.

Identification needs nothing else of a robot, so any arm serves, whatever the format of its file. Frames: W the
robot's base, T the tip, to which the payload is fixed; L a link, at its joint's moving frame.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm import Arm, JointLimits, attach_body
from affordance.plant.chain_kinematics import SerialChain
from affordance.plant.wrench_regressor import compute_payload_regressors, compute_regressors_at


@dataclass(frozen=True)
class RobotChain:
    """Serial arm with named joints.

    Attributes:
        source: File of the robot, for messages.
        joint_names: Names of the joints from base to tip.
        tip: Name of the frame T.
        chain: Kinematics from W to T, with gravity expressed in W.
        link_parameters: Ten inertial parameters of each link about its joint's moving frame L, expressed in L, shape
            (num_joints, 10); everything fixed to a link is part of it.
        limits: Least and largest angle of each joint by the file, shape (2, num_joints), [rad]; infinite without any.
    """

    source: str
    joint_names: tuple[str, ...]
    tip: str
    chain: SerialChain
    link_parameters: Array
    limits: Array

    def __repr__(self) -> str:
        return f"RobotChain({self.source} to {self.tip}: {', '.join(self.joint_names)})"

    @property
    def num_joints(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def fingerprint(self) -> str:
        """Text by which the arm is recognised, whatever the name of its file and its mounting."""
        chain = self.chain
        parts = (chain.R_PF, chain.p_PF, chain.axes, chain.R_MT, chain.p_MT, self.link_parameters)
        digest = hashlib.sha256(" ".join(self.joint_names).encode())
        for part in parts:
            digest.update(np.round(part, 6).tobytes())
        return digest.hexdigest()[:12]

    def with_gravity(self, gravity_W: Sequence[float] | Array) -> "RobotChain":
        """Returns the arm in another mounting, with gravity_W in its base frame, shape (3,), [m/s^2]."""
        return replace(self, chain=replace(self.chain, gravity_W=np.array(gravity_W, dtype=float)))

    def compute_payload_regressors(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes Y of the payload at T along a trajectory of q, v and vdot, shape (N, num_joints, 10)."""
        return compute_payload_regressors(self.chain, q, v, vdot)

    def compute_link_regressors(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes regressors of the joint torques on the links' parameters, (N, num_joints, 10 num_joints)."""
        regressors = np.zeros((*q.shape, self.num_joints, NUM_PARAMETERS))
        for link, motion in enumerate(self.chain.compute_link_motions(q, v, vdot)):
            regressors[:, : link + 1, link] = compute_regressors_at(self.chain, motion)
        return regressors.reshape(*q.shape, -1)

    def compute_arm_torques(self, q: Array, v: Array, vdot: Array) -> Array:
        """Computes the torques of the arm alone from its link parameters, shape (N, num_joints), [N m]."""
        torques = np.zeros_like(q)
        for link, motion in enumerate(self.chain.compute_link_motions(q, v, vdot)):
            column = self.link_parameters[link, :, None]
            torques[:, : link + 1] += compute_regressors_at(self.chain, motion, column)[..., 0]
        return torques


@runtime_checkable
class ChainOwner(Protocol):
    """Robot that has a chain, such as a ``Robot``."""

    @property
    def chain(self) -> RobotChain:
        """Chain of joints and links up to the hand."""


def build_arm(robot: RobotChain, link_parameters: Array | None = None) -> Arm:
    """Builds the Drake plant of a chain, for single states some ten times as fast as trajectories of one sample.

    Link parameters, shape (n, 10), need not be physically consistent; None for the file's.
    """
    plant = MultibodyPlant(0.0)
    instance = plant.AddModelInstance("robot")
    parameters = robot.link_parameters if link_parameters is None else link_parameters
    chain = robot.chain
    parent = plant.world_body()
    for name, R, p, axis, pi in zip(robot.joint_names, chain.R_PF, chain.p_PF, chain.axes, parameters, strict=True):
        link = plant.AddRigidBody(f"{name}_link", instance, _build_inertia(pi))
        X_PF = RigidTransform(RotationMatrix(R), p)
        frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent.body_frame(), X_PF))
        plant.AddJoint(RevoluteJoint(name, frame, link.body_frame(), axis))
        parent = link
    X_MT = RigidTransform(RotationMatrix(chain.R_MT), chain.p_MT)
    tip = plant.AddFrame(FixedOffsetFrame(robot.tip, parent.body_frame(), X_MT))
    tool = attach_body(plant, tip, SpatialInertia.Zero())
    plant.mutable_gravity_field().set_gravity_vector(chain.gravity_W)
    plant.Finalize()
    unbounded = np.full(robot.num_joints, np.inf)
    limits = JointLimits(-unbounded, unbounded, unbounded, unbounded)
    return Arm(Path(robot.source), plant, tip, tool, np.zeros(robot.num_joints), limits)


def _build_inertia(pi: Array) -> SpatialInertia:
    mass = float(pi[0])
    if mass == 0.0:
        return SpatialInertia.Zero()
    G = UnitInertia(*(float(value) / mass for value in pi[4:]))
    return SpatialInertia(mass, pi[1:4] / mass, G, skip_validity_check=True)
