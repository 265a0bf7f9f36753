"""Builds a Drake plant of a serial chain: ten times faster for single states than trajectories of one sample."""

from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia, UnitInertia

from affordance.arrays import Array
from affordance.plant.arm import Arm, JointLimits, attach_body
from affordance.plant.serial_chain import SerialChain


def build_arm(chain: SerialChain, link_parameters: Array | None = None) -> Arm:
    """Builds an arm without limits from a chain.

    ``link_parameters``, (n, 10), replace the chain's, and need not be physically consistent.
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
