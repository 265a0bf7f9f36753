"""Serial chain of a Drake plant: its constants, read once for kinematics along whole trajectories."""

import functools

import numpy as np
from pydrake.multibody.tree import Frame, Joint, RevoluteJoint
from pydrake.systems.framework import Context

from affordance.exceptions import ModelFileError
from affordance.plant.arm import Arm
from affordance.plant.chain_kinematics import ChainMotion, SerialChain

__all__ = ["ChainMotion", "SerialChain", "build_chain"]


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
    """Refuses plants whose joints branch: the chain's position of a point of the tool would then be wrong."""
    p_TQ = np.array([0.1, 0.2, 0.3])
    q = np.linspace(0.1, 1.0, arm.num_joints)
    arm.plant.SetPositions(context, q)
    p_WQ = arm.tool.body_frame().CalcPoseInWorld(context) @ p_TQ
    if not np.allclose(chain.compute_positions(q[None], p_TQ)[0], p_WQ, rtol=0.0, atol=1e-9):
        raise ModelFileError(arm.source, "has joints that do not lie one after the other from base to hand")
