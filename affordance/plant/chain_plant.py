"""Converts Drake plants to serial chains, and serial chains to plants."""

import functools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    Frame,
    Joint,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.framework import Context

from affordance.arrays import Array
from affordance.exceptions import ModelFileError
from affordance.objects.inertia import NUM_PARAMETERS, parameters_from_spatial_inertia
from affordance.plant.arm import Arm, JointLimits, attach_body
from affordance.plant.serial_chain import SerialChain


@functools.lru_cache(maxsize=4)
def build_chain(arm: Arm) -> SerialChain:
    """Builds the serial chain from W to the tool.

    Raises:
        ModelFileError: The arm branches, or a joint is not revolute.
    """
    plant = arm.plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.zeros(arm.num_joints))
    joints: list[Joint] = [plant.get_joint(index) for index in plant.GetJointIndices()]
    moving = sorted((joint for joint in joints if joint.num_velocities() > 0), key=Joint.velocity_start)
    revolute = [joint for joint in moving if isinstance(joint, RevoluteJoint)]
    if others := [joint.name() for joint in moving if not isinstance(joint, RevoluteJoint)]:
        raise ModelFileError(arm.source, f"has joint {others[0]}, which is not revolute; all joints must be revolute")
    moved = [set(plant.GetBodiesKinematicallyAffectedBy([joint.index()])) for joint in revolute]
    groups = [own - beyond for own, beyond in zip(moved, [*moved[1:], {arm.tool.index()}], strict=True)]
    tip = arm.tool.body_frame()
    chain = read_chain(arm.source, plant, context, plant.world_frame(), revolute, tip, arm.tool.name(), groups)
    # For joints that branch, the chain computes wrong positions of points of the tool.
    p_TQ = np.array([0.1, 0.2, 0.3])
    q = np.linspace(0.1, 1.0, arm.num_joints)
    plant.SetPositions(context, q)
    p_WQ = tip.CalcPoseInWorld(context) @ p_TQ
    if not np.allclose(chain.compute_positions(q[None], p_TQ)[0], p_WQ, rtol=0.0, atol=1e-9):
        raise ModelFileError(arm.source, "has joints that are not in series from base to hand")
    return chain


def build_unmounted_chain(arm: Arm) -> SerialChain:
    """Builds the serial chain from the last fixed link to the hand, independent of the arm's mounting."""
    chain, plant = build_chain(arm), arm.plant
    joints: list[Joint] = [plant.get_joint(index) for index in plant.GetJointIndices()]
    # Bodies are identified by index, because the stand and the arm may use the same name.
    above = {joint.child_body().index(): joint.parent_body() for joint in joints}
    first = min((joint for joint in joints if joint.num_velocities() > 0), key=Joint.velocity_start)
    root = first.parent_body()
    while (below := above.get(root.index())) is not None and below.index() != plant.world_body().index():
        root = below
    X_RP = first.frame_on_parent().CalcPose(plant.CreateDefaultContext(), root.body_frame())
    R_PF, p_PF = chain.R_PF.copy(), chain.p_PF.copy()
    R_PF[0], p_PF[0] = X_RP.rotation().matrix(), X_RP.translation()
    return replace(chain, R_PF=R_PF, p_PF=p_PF, tip=arm.hand.name())


def recognise_arm(arm: Arm) -> str:
    """Computes the fingerprint of an arm without its mounting.

    An arm on a stand therefore has the same fingerprint as in the robot's own file.
    """
    return build_unmounted_chain(arm).fingerprint


def read_chain(
    source: Path,
    plant: MultibodyPlant,
    context: Context,
    start: Frame,
    joints: Sequence[RevoluteJoint],
    tip: Frame,
    tip_name: str,
    bodies: Sequence[set[BodyIndex]],
) -> SerialChain:
    """Reads the serial chain from a frame to a tip.

    Args:
        source: File of the robot, for messages.
        plant: Plant of the robot.
        context: Context of the plant in which all joint angles are zero.
        start: Frame at which the chain begins.
        joints: Joints from base to tip.
        tip: Frame at which the chain ends.
        tip_name: Name of the tip.
        bodies: Bodies that belong to each joint's link.
    """
    poses = []
    for joint in joints:
        poses.append(joint.frame_on_parent().CalcPose(context, start))
        start = joint.frame_on_child()
    X_MT = tip.CalcPose(context, start)
    parameters = np.zeros((len(joints), NUM_PARAMETERS))
    speeds = np.array([joint.velocity_upper_limits()[0] for joint in joints])
    accelerations = np.array([joint.acceleration_upper_limits()[0] for joint in joints])
    for joint, group, row in zip(joints, bodies, parameters, strict=True):
        if with_mass := [body for body in sorted(group) if plant.get_body(body).default_mass() > 0.0]:
            row[:] = parameters_from_spatial_inertia(
                plant.CalcSpatialInertia(context, joint.frame_on_child(), with_mass)
            )
    return SerialChain(
        source=str(source),
        joint_names=tuple(joint.name() for joint in joints),
        tip=tip_name,
        R_PF=np.array([X_PF.rotation().matrix() for X_PF in poses]),
        p_PF=np.array([X_PF.translation() for X_PF in poses]),
        axes=np.array([joint.revolute_axis() for joint in joints]),
        R_MT=X_MT.rotation().matrix(),
        p_MT=X_MT.translation(),
        gravity_W=plant.gravity_field().gravity_vector(),
        link_parameters=parameters,
        limits=np.array([[joint.position_lower_limits()[0], joint.position_upper_limits()[0]] for joint in joints]).T,
        velocity_limits=np.where(speeds > 0.0, speeds, np.inf),  # some files have 0 for an unknown limit
        acceleration_limits=np.where(accelerations > 0.0, accelerations, np.inf),
    )


def build_arm(chain: SerialChain, link_parameters: Array | None = None) -> Arm:
    """Builds an arm without limits from a chain. For a single state, it is ten times faster than the chain.

    Args:
        chain: Chain of joints and links.
        link_parameters: Inertial parameters of the links, (n, 10), which may be physically inconsistent; None for the
            chain's own.
    """
    plant = MultibodyPlant(0.0)
    instance = plant.AddModelInstance("robot")
    parameters = chain.link_parameters if link_parameters is None else link_parameters
    parent = plant.world_body()
    for name, R, p, axis, pi in zip(chain.joint_names, chain.R_PF, chain.p_PF, chain.axes, parameters, strict=True):
        link = plant.AddRigidBody(f"{name}_link", instance, _build_inertia(pi))
        X_PF = RigidTransform(RotationMatrix(R), p)
        frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent.body_frame(), X_PF))
        plant.AddJoint(RevoluteJoint(name, frame, link.body_frame(), axis))
        parent = link
    X_MT = RigidTransform(RotationMatrix(chain.R_MT), chain.p_MT)
    tip = plant.AddFrame(FixedOffsetFrame(chain.tip, parent.body_frame(), X_MT))
    tool = attach_body(plant, tip, SpatialInertia.Zero())
    plant.mutable_gravity_field().set_gravity_vector(chain.gravity_W)
    plant.Finalize()
    unbounded = np.full(chain.num_joints, np.inf)
    limits = JointLimits(-unbounded, unbounded, unbounded, unbounded)
    return Arm(Path(chain.source), plant, tip, tool, np.zeros(chain.num_joints), limits)


def _build_inertia(pi: Array) -> SpatialInertia:
    mass = float(pi[0])
    if mass == 0.0:
        return SpatialInertia.Zero()
    G = UnitInertia(*(float(value) / mass for value in pi[4:]))
    return SpatialInertia(mass, pi[1:4] / mass, G, skip_validity_check=True)
