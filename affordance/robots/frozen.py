"""Positions at which joints outside the arm are frozen."""

import difflib
from collections.abc import Mapping

import numpy as np
from pydrake.multibody.tree import PrismaticJoint, RevoluteJoint
from pydrake.systems.framework import Context

from affordance.exceptions import BadValueError
from affordance.robots.chain import Chain
from affordance.robots.tree import RobotTree


def check_posture(tree: RobotTree, posture: Mapping[str, float]) -> None:
    """Raises a BadValueError for the first value of a joint that cannot be set, or that is beyond its limits."""
    joints = {joint.name(): joint for joint in tree.joints_above.values() if joint.num_velocities()}
    for name, value in posture.items():
        joint = joints.get(name)
        if joint is None:
            near = difflib.get_close_matches(name, joints, n=3, cutoff=0.4) or sorted(joints)[:8]
            problem = f"names {name!r}, which is not a moving joint of {tree.description.path}"
            raise BadValueError("--posture", "", f"{problem}; nearest: {', '.join(near)}")
        mimic = tree.note(joint).mimic
        if mimic is not None:
            raise BadValueError("--posture", "", f"names {name!r}, which follows {mimic.leader}")
        if not isinstance(joint, RevoluteJoint | PrismaticJoint):
            raise BadValueError("--posture", "", f"names {name!r}, which is of type {joint.type_name()}")
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if not low <= value <= high:
            raise BadValueError("--posture", "", f"puts {name} at {value:g}, must be from {low:g} to {high:g}")


def freeze(tree: RobotTree, chain: Chain, posture: Mapping[str, float]) -> tuple[Context, dict[str, float]]:
    """Creates a context with the chain's joints at zero and all others where they are frozen, with their values.

    A joint that is not given is frozen at its default, clipped to its limits; one that follows another at the
    position implied by its leader.
    """
    context = tree.plant.CreateDefaultContext()
    own = {joint.index() for joint in chain.joints}
    movable = [joint for joint in tree.joints_above.values() if isinstance(joint, RevoluteJoint | PrismaticJoint)]
    by_name = {(joint.model_instance(), joint.name()): joint for joint in movable}
    values: dict[str, float] = {}

    def find(joint: RevoluteJoint | PrismaticJoint, followed: tuple[str, ...] = ()) -> float:
        mimic, name = tree.note(joint).mimic, joint.name()
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        leader = None if mimic is None else by_name.get((joint.model_instance(), mimic.leader))
        if mimic is not None and leader is not None and name not in followed:
            return mimic.multiplier * find(leader, (*followed, name)) + mimic.offset
        default = 0.0 if joint.index() in own else joint.default_positions()[0]
        return float(posture.get(name, np.clip(default, low, high)))

    for joint in movable:
        value = 0.0 if joint.index() in own else find(joint)
        if joint.index() not in own:
            values[joint.name()] = value
        if isinstance(joint, RevoluteJoint):
            joint.set_angle(context, value)
        else:
            joint.set_translation(context, value)
    return context, values
