"""Serial chain of a Drake plant: its constants, read once for kinematics along whole trajectories."""

import functools
from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, RevoluteJoint
from pydrake.systems.framework import Context

from affordance.exceptions import ModelFileError
from affordance.plant.arm import Arm
from affordance.plant.chain_kinematics import ChainMotion, SerialChain

__all__ = ["ChainMotion", "SerialChain", "build_chain", "read_chain"]


@functools.lru_cache(maxsize=4)
def build_chain(arm: Arm) -> SerialChain:
    """Reads the constants of the chain from W to the tool from a Drake plant.

    Raises:
        ModelFileError: The joints are not revolute, or do not form a serial chain.
    """
    plant = arm.plant
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.zeros(arm.num_joints))
    joints: list[Joint] = [plant.get_joint(index) for index in plant.GetJointIndices()]
    moving = sorted((joint for joint in joints if joint.num_velocities() > 0), key=Joint.velocity_start)
    revolute = [joint for joint in moving if isinstance(joint, RevoluteJoint)]
    if others := [joint.name() for joint in moving if not isinstance(joint, RevoluteJoint)]:
        raise ModelFileError(arm.source, f"has joint {others[0]}, which is not revolute as all must be")
    chain = read_chain(plant, context, plant.world_frame(), revolute, arm.tool.body_frame())
    _check_against_plant(chain, arm, context)
    return chain


def read_chain(
    plant: MultibodyPlant, context: Context, start: Frame, joints: Sequence[RevoluteJoint], tip: Frame
) -> SerialChain:
    """Reads the constants of a chain of joints from a frame to a tip, in a context with the joints at zero."""
    poses = []
    for joint in joints:
        poses.append(joint.frame_on_parent().CalcPose(context, start))
        start = joint.frame_on_child()
    X_MT = tip.CalcPose(context, start)
    return SerialChain(
        np.array([X_PF.rotation().matrix() for X_PF in poses]),
        np.array([X_PF.translation() for X_PF in poses]),
        np.array([joint.revolute_axis() for joint in joints]),
        X_MT.rotation().matrix(),
        X_MT.translation(),
        plant.gravity_field().gravity_vector(),
    )


def _check_against_plant(chain: SerialChain, arm: Arm, context: Context) -> None:
    """Refuses plants whose joints branch: the chain's position of a point of the tool would then be wrong."""
    p_TQ = np.array([0.1, 0.2, 0.3])
    q = np.linspace(0.1, 1.0, arm.num_joints)
    arm.plant.SetPositions(context, q)
    p_WQ = arm.tool.body_frame().CalcPoseInWorld(context) @ p_TQ
    if not np.allclose(chain.compute_positions(q[None], p_TQ)[0], p_WQ, rtol=0.0, atol=1e-9):
        raise ModelFileError(arm.source, "has joints that do not lie one after the other from base to hand")
