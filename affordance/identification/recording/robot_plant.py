"""Drake plant of a chain for single states, some ten times as fast as trajectories of one sample."""

from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia

from affordance.arrays import Array
from affordance.identification.recording.robot_chain import RobotChain
from affordance.plant.arm import Arm, JointLimits
from affordance.plant.load import attach_tool


def build_arm(robot: RobotChain, link_parameters: Array | None = None) -> Arm:
    """Builds the plant of a chain.

    Args:
        robot: Chain to build.
        link_parameters: Ten parameters of each link, shape (n, 10), which need not be physically consistent; None for
            the file's.
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
    tool = attach_tool(plant, tip, None)
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
