"""Which joints are the arm: from the tip up to where the arm begins."""

from typing import NamedTuple

from pydrake.multibody.tree import Frame, Joint, RevoluteJoint, RigidBody

from affordance.exceptions import BadValueError
from affordance.robots.tree import RobotTree

# So many moving joints in series, beside the arm, make a limb of their own; one is a neck or a gripper's finger.
_LIMB = 2
# An arm that would end below a joint that cannot be its own has at least so many, or the joint is rejected.
_FEWEST = 3


class Chain(NamedTuple):
    """An arm's place in a robot.

    Attributes:
        base: The body it is fixed by.
        joints: Its joints, from base to tip, all revolute.
        tip: The frame at its end.
        why_base: Why it begins there, in words.
    """

    base: RigidBody
    joints: tuple[RevoluteJoint, ...]
    tip: Frame
    why_base: str


def find_chain(tree: RobotTree, tip_name: str, base_name: str | None) -> Chain:
    """Finds the joints between tip and base.

    Without a base the arm begins below the first joint that slides or floats, or at the first link from which another
    limb leaves; else at the robot's root.

    Args:
        tree: The robot.
        tip_name: Link or frame at the arm's end.
        base_name: Link that is fixed to the world; None to find one.

    Raises:
        BadValueError: A name is unknown, the base is not above the tip, or a joint between them is not revolute or
            follows another.
    """
    tip = tree.find_frame(tip_name, "--tip")
    body = tip.body()
    base = None if base_name is None else tree.find_frame(base_name, "--base").body()
    if base is not None and base.index() != body.index():
        above = [joint.parent_body() for joint in tree.climb(body)]
        if base.index() not in [link.index() for link in above]:
            names = ", ".join(link.name() for link in above)
            raise BadValueError("--base", "", f"is {base_name!r}, which is not above {tip_name}, must be of {names}")
    joints: list[RevoluteJoint] = []
    why = "it is the robot's root"
    for joint in tree.climb(tip.body()):
        if base is not None and body.index() == base.index():
            break
        if base is None and joints and (limb := _find_limb(tree, body, joints[0])):
            why = f"another limb leaves from it, by {limb}"
            break
        if joint.num_velocities():
            problem = _find_obstacle(tree, joint)
            if problem and base is None and len(joints) >= _FEWEST:
                why = f"the joint above it, {joint.name()}, {problem}"
                break
            if problem:
                raise BadValueError(tree.description.path, f"joint {joint.name()}", f"{problem}; it is on the chain")
            assert isinstance(joint, RevoluteJoint)
            joints.insert(0, joint)
        body = joint.parent_body()
    if base is not None:
        why = "it was given"
    if not joints:
        where = f"between it and {body.name()}" if body.name() != "world" else "between it and the world"
        raise BadValueError("--tip", "", f"is {tip_name!r}, with no joint that turns {where}")
    if body.name() == "world":
        body = joints[0].parent_body()
    return Chain(body, tuple(joints), tip, why)


def _find_obstacle(tree: RobotTree, joint: Joint) -> str:
    """Why a joint cannot be the arm's; empty if it can."""
    notes = tree.description.joints.get(joint.name())
    if notes is not None and notes.mimic is not None:
        return f"follows {notes.mimic.leader} (mimic), must move on its own"
    if not isinstance(joint, RevoluteJoint):
        return f"is of type {joint.type_name()}, must be revolute"
    return ""


def _find_limb(tree: RobotTree, body: RigidBody, down: Joint) -> str:
    """The first joint of a limb that leaves a body elsewhere than by a joint; empty if none."""
    children = [joint for joint in tree.joints_above.values() if joint.parent_body().index() == body.index()]
    for joint in children:
        if joint.index() == down.index() or _contains(tree, joint, down):
            continue
        if _count_in_series(tree, joint) >= _LIMB:
            return str(joint.name())
    return ""


def _contains(tree: RobotTree, joint: Joint, other: Joint) -> bool:
    """Whether another joint hangs on what hangs on a joint."""
    return any(above.index() == joint.index() for above in tree.climb(other.parent_body()))


def _count_in_series(tree: RobotTree, joint: Joint) -> int:
    """Most moving joints one after the other, from a joint down."""
    below = [
        _count_in_series(tree, other)
        for other in tree.joints_above.values()
        if other.parent_body().index() == joint.child_body().index()
    ]
    return int(joint.num_velocities() > 0) + max(below, default=0)
