"""Where the joints that are not the arm's are frozen."""

import difflib
import math
from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.multibody.tree import Joint, PrismaticJoint, RevoluteJoint
from pydrake.systems.framework import Context

from affordance.exceptions import BadValueError
from affordance.robots.chain import Chain
from affordance.robots.tree import RobotTree


def parse_values(option: str, words: Sequence[str]) -> dict[str, float]:
    """Parses words such as ``elbow=0.3``.

    Raises:
        BadValueError: A word is not so, or names a joint twice.
    """
    values: dict[str, float] = {}
    for word in words:
        name, _, text = word.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not name or not math.isfinite(value):
            raise BadValueError(option, "", f"is {word!r}, must be JOINT=VALUE")
        if name in values:
            raise BadValueError(option, "", f"gives {name} twice")
        values[name] = value
    return values


def check_posture(tree: RobotTree, posture: Mapping[str, float]) -> None:
    """Rejects values for joints that the robot has not, that follow others, or that go beyond limits.

    Raises:
        BadValueError: The first of them.
    """
    joints = {joint.name(): joint for joint in tree.joints_above.values() if joint.num_velocities()}
    for name, value in posture.items():
        joint = joints.get(name)
        if joint is None:
            near = difflib.get_close_matches(name, joints, n=3, cutoff=0.4) or sorted(joints)[:8]
            problem = f"names {name!r}, which is no moving joint of {tree.description.path}"
            raise BadValueError("--posture", "", f"{problem}; nearest: {', '.join(near)}")
        notes = tree.description.joints.get(name)
        if notes is not None and notes.mimic is not None:
            raise BadValueError("--posture", "", f"names {name!r}, which follows {notes.mimic.leader}")
        if not isinstance(joint, RevoluteJoint | PrismaticJoint):
            raise BadValueError("--posture", "", f"names {name!r}, which is of type {joint.type_name()}")
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if not low <= value <= high:
            raise BadValueError("--posture", "", f"puts {name} at {value:g}, must be from {low:g} to {high:g}")


def freeze(tree: RobotTree, chain: Chain, posture: Mapping[str, float]) -> tuple[Context, dict[str, float]]:
    """Sets a scratch context: joints of the chain at zero, all others where they are frozen.

    A joint that is not given stays at its default, or the nearest value within its limits; one that follows another
    is where that one puts it.

    Returns: The plant's context, and the value of every frozen joint of one degree of freedom.
    """
    context = tree.plant.CreateDefaultContext()
    own = {joint.name() for joint in chain.joints}
    movable = {
        joint.name(): joint
        for joint in tree.joints_above.values()
        if isinstance(joint, RevoluteJoint | PrismaticJoint)
    }
    values: dict[str, float] = {}

    def find(name: str, joint: Joint, followed: tuple[str, ...] = ()) -> float:
        notes = tree.description.joints.get(name)
        low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        default = joint.default_positions()[0]
        if notes is not None and notes.mimic is not None and notes.mimic.leader in movable and name not in followed:
            leader = notes.mimic.leader
            of_leader = find(leader, movable[leader], (*followed, name))
            return notes.mimic.multiplier * of_leader + notes.mimic.offset
        return float(posture.get(name, np.clip(0.0 if name in own else default, low, high)))

    for name, joint in movable.items():
        value = 0.0 if name in own else find(name, joint)
        if name not in own:
            values[name] = value
        if isinstance(joint, RevoluteJoint):
            joint.set_angle(context, value)
        else:
            joint.set_translation(context, value)
    return context, values
