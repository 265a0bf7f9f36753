"""Joints of the arm, from the tip up to the base."""

from typing import NamedTuple

from pydrake.multibody.tree import Frame, RevoluteJoint, RigidBody

from affordance.exceptions import BadValueError
from affordance.robots.ends import describe_ends, suggest_frames
from affordance.robots.limbs import climb_limb, find_hand
from affordance.robots.tree import RobotTree


class Chain(NamedTuple):
    """Chain of joints that forms the arm of a robot.

    Attributes:
        base: Body that is fixed to the world.
        joints: Joints of the arm, from base to tip, all revolute.
        tip: Frame at the end of the arm.
        why_base: Reason for this base, in words.
    """

    base: RigidBody
    joints: tuple[RevoluteJoint, ...]
    tip: Frame
    why_base: str


def find_chain(tree: RobotTree, tip_name: str, base_name: str | None) -> Chain:
    """Finds the joints between tip and base.

    Without a base the arm begins below the first joint that slides or floats, or at the first link with another limb;
    otherwise at the robot's root.

    Args:
        tree: Robot.
        tip_name: Link or frame at the arm's end.
        base_name: Link that is fixed to the world; None to find one.

    Raises:
        BadValueError: A name is unknown, the tip is on a finger, the base is not above the tip, or a joint between
            them is not revolute or follows another.
    """
    path = tree.description.path
    if not tip_name:
        raise BadValueError(
            "--tip", "", f"is missing: link or frame of {path} that holds things; {describe_ends(tree)}"
        )
    tip = tree.find_frame(tip_name, "--tip")
    if tip is None:
        raise BadValueError("--tip", "", f"is {tip_name!r}, which {path} has not; {describe_ends(tree, tip_name)}")
    base = None
    if base_name is not None:
        frame = tree.find_frame(base_name, "--base")
        if frame is None:
            near = suggest_frames(tree, base_name)
            raise BadValueError("--base", "", f"is {base_name!r}, which {path} has not; {near}")
        base = frame.body()
        _check_is_above(tree, base, base_name, tip, tip_name)
    elif (hand := find_hand(tree, tip.body())) is not None:
        problem = f"is {tip_name!r}, which is on a finger of {hand.name()}, must be a link that no finger moves"
        raise BadValueError("--tip", "", f"{problem}: {hand.name()}? A --base makes an arm of the finger")
    limb = climb_limb(tree, tip.body(), base)
    if limb.obstacle is not None:
        joint, problem = limb.obstacle
        raise BadValueError(path, f"joint {joint.name()}", f"{problem}; it is on the chain")
    if not limb.joints:
        where = f"between it and {limb.base.name()}"
        raise BadValueError("--tip", "", f"is {tip_name!r}, with no joint that turns {where}")
    why = "it was given" if base is not None else limb.why_base
    return Chain(limb.base, limb.joints, tip, why)


def _check_is_above(tree: RobotTree, base: RigidBody, base_name: str, tip: Frame, tip_name: str) -> None:
    """Rejects a base that is not above the tip.

    Raises:
        BadValueError: The base is neither the tip's body nor above it.
    """
    above = [joint.parent_body() for joint in tree.climb(tip.body())]
    if base.index() not in [tip.body().index(), *(link.index() for link in above)]:
        names = ", ".join(link.name() for link in above)
        raise BadValueError("--base", "", f"is {base_name!r}, which is not above {tip_name}, must be of {names}")
