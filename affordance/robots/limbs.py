"""Limbs of a robot: joints in series up to the next branch, and the fingers at their ends."""

from typing import NamedTuple

from pydrake.multibody.tree import Joint, RevoluteJoint, RigidBody

from affordance.robots.tree import RobotTree

# Fewest moving joints in series that count as another limb; a single one is a neck or a gripper's finger.
_LIMB = 2
# Fewest joints of an arm that may begin below an unsuitable joint; with fewer, that joint is rejected.
FEWEST_JOINTS = 3


class Limb(NamedTuple):
    """Chain of joints above a body.

    Attributes:
        base: Body at the upper end of the joints.
        joints: Joints from base to body, all revolute.
        why_base: Reason why the limb begins there, in words.
        obstacle: Unsuitable joint that ends the climb too early, and the reason; None for none.
    """

    base: RigidBody
    joints: tuple[RevoluteJoint, ...]
    why_base: str
    obstacle: tuple[Joint, str] | None = None


def climb_limb(tree: RobotTree, body: RigidBody, base: RigidBody | None = None) -> Limb:
    """Collects the joints above a body.

    Args:
        tree: Robot.
        body: Body at which the joints end.
        base: Body at which they begin, above the other; None to find the upper end of the limb.
    """
    joints: list[RevoluteJoint] = []
    for joint in tree.climb(body):
        if base is not None and body.index() == base.index():
            break
        if base is None and joints and (limb := _find_other_limb(tree, body, joints[0])):
            return Limb(body, tuple(joints), f"another limb leaves from it, by {limb}")
        if joint.num_velocities():
            problem = _find_obstacle(tree, joint)
            if problem and base is None and len(joints) >= FEWEST_JOINTS:
                return Limb(body, tuple(joints), f"the joint above it, {joint.name()}, {problem}")
            if problem:
                return Limb(body, tuple(joints), "", (joint, problem))
            assert isinstance(joint, RevoluteJoint)
            joints.insert(0, joint)
        body = joint.parent_body()
    if body.name() == "world" and joints:
        body = joints[0].parent_body()
    root = _find_root(tree, body)
    if root.index() == body.index():
        return Limb(body, tuple(joints), "it is the robot's root")
    return Limb(body, tuple(joints), f"no joint above it moves, up to the robot's root, {root.name()}")


def find_hand(tree: RobotTree, body: RigidBody) -> RigidBody | None:
    """Finds the link that carries the finger of a body; None if the body is not on a finger.

    A finger is carried by a limb with at least as many joints, and branches off with other fingers or by a joint that
    is unsuitable for an arm.
    """
    finger = climb_limb(tree, body)
    if finger.obstacle is not None:
        carrier = finger.obstacle[0].parent_body()
    elif not finger.joints:
        return None
    else:
        carrier = finger.base
        last = finger.joints[-1].parent_body()
        if len(finger.joints) > FEWEST_JOINTS and _moves_another(tree, last, finger.joints[-1]):
            carrier = last
    arm = climb_limb(tree, carrier)
    own = sum(joint.num_velocities() > 0 for joint in _climb_to(tree, body, carrier))
    if arm.obstacle is not None or len(arm.joints) < FEWEST_JOINTS or len(arm.joints) < own:
        return None
    return find_hand(tree, carrier) or carrier


def _climb_to(tree: RobotTree, body: RigidBody, carrier: RigidBody) -> list[Joint]:
    """Lists the joints from a body up to one above it."""
    joints = []
    for joint in tree.climb(body):
        joints.append(joint)
        if joint.parent_body().index() == carrier.index():
            break
    return joints


def _find_root(tree: RobotTree, body: RigidBody) -> RigidBody:
    """Finds the uppermost link above a body."""
    for joint in tree.climb(body):
        if joint.parent_body().name() == "world":
            break
        body = joint.parent_body()
    return body


def _find_obstacle(tree: RobotTree, joint: Joint) -> str:
    """Describes why a joint cannot belong to the arm; empty if it can."""
    mimic = tree.note(joint).mimic
    if mimic is not None:
        return f"follows {mimic.leader} (mimic), must move on its own"
    if not isinstance(joint, RevoluteJoint):
        return f"is of type {joint.type_name()}, must be revolute"
    return ""


def _moves_another(tree: RobotTree, body: RigidBody, down: Joint) -> bool:
    """Returns True if a joint other than the given one moves something on a body."""
    return any(_count_in_series(tree, joint) for joint in _list_others(tree, body, down))


def _find_other_limb(tree: RobotTree, body: RigidBody, down: Joint) -> str:
    """Finds the first joint of a limb on a body other than a given joint's limb; empty if not found."""
    limbs = (joint for joint in _list_others(tree, body, down) if _count_in_series(tree, joint) >= _LIMB)
    return next((str(joint.name()) for joint in limbs), "")


def _list_others(tree: RobotTree, body: RigidBody, down: Joint) -> list[Joint]:
    """Lists the joints on a body that do not lead to a joint below it."""
    children = [joint for joint in tree.joints_above.values() if joint.parent_body().index() == body.index()]
    return [joint for joint in children if joint.index() != down.index() and not _contains(tree, joint, down)]


def _contains(tree: RobotTree, joint: Joint, other: Joint) -> bool:
    """Returns True if one joint leads to another."""
    return any(above.index() == joint.index() for above in tree.climb(other.parent_body()))


def _count_in_series(tree: RobotTree, joint: Joint) -> int:
    """Counts the moving joints on the longest path down from a joint, including it."""
    below = [
        _count_in_series(tree, other)
        for other in tree.joints_above.values()
        if other.parent_body().index() == joint.child_body().index()
    ]
    return int(joint.num_velocities() > 0) + max(below, default=0)
