"""Finds the joints of an arm from its tip to its base, and the ends of all limbs.

A limb is a series of joints up to the next branch, and its end can be a tip. Fingers are limbs at the end of another
limb.
"""

import difflib
import re
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import BodyIndex, Frame, Joint, RevoluteJoint, RigidBody

from affordance.exceptions import BadValueError
from affordance.extensions.robots.tree import RobotTree

# Least number of moving joints in series that form a limb; a single joint is a neck or a gripper's finger.
_LIMB = 2
# An arm with at least this many joints may begin below an unsuitable joint; otherwise that joint is an error.
FEWEST_JOINTS = 3
# Words in names of tool frames, in order of preference (tool0 is ROS-Industrial's).
_TOOL_WORDS = (
    "tcp",
    "tool",
    "grasp|grip",
    "^ee|_ee|eef|end_?effector",
    "flange",
    "attach",
    "hand|palm",
    "(^|_)end(_|$)",
)
# Words in names of sensors mounted next to the tool frame, and of parts of grippers.
_ASIDE = re.compile("cam|sensor|optical|imu|finger|jaw|servo", re.IGNORECASE)
# A joint moves a gripper's jaw if the name of its link, or its own name, contains one of these words, unless the
# joint rotates the gripper.
_JAW = re.compile("jaw|finger|claw|thumb", re.IGNORECASE)
_GRIPS = re.compile("grip|jaw|finger|claw|thumb", re.IGNORECASE)
_TURNS = re.compile("roll|yaw|pitch|rot|turn|twist|wrist|base", re.IGNORECASE)
# A last joint also counts as a jaw if it rotates to one side only, from within _SHUT of zero by at most _OPEN, and if
# its effort limit is at most _WEAK times that of the joint above it. [rad, rad, 1]
_SHUT, _OPEN, _WEAK = 0.05, 0.5 * np.pi, 0.5
_FOR_TOOLS = re.compile("|".join(_TOOL_WORDS), re.IGNORECASE)
# Largest number of names in a message, per limb and in total.
_OF_A_LIMB, _LISTED = 3, 12


# Verbs for joints that are not revolute, by Drake's joint type.
_MOVES = {
    "prismatic": "slides",
    "quaternion_floating": "floats",
    "rpy_floating": "floats",
    "planar": "slides in a plane",
}


class Chain(NamedTuple):
    """Joints of an arm or limb."""

    base: RigidBody  # body above the first joint, which is fixed to the world
    joints: tuple[RevoluteJoint, ...]  # joints from base to tip, all revolute
    tip: Frame
    why_base: str  # reason for the choice of the base, in words
    # Unsuitable joint at which the search for the base ended, and the reason; None without one.
    obstacle: tuple[Joint, str] | None = None
    above: str = ""  # sentence about an unsuitable moving joint above the base; empty without one


def find_chain(tree: RobotTree, tip_name: str, base_name: str | None) -> Chain:
    """Finds the joints between tip and base.

    Without a given base, the arm begins below the first prismatic or floating joint, or at the first link that
    carries another limb; otherwise, it begins at the robot's root.

    Raises:
        BadValueError: A name is unknown, the tip is on a finger, the base is not above the tip, or a joint between
            them is not revolute or follows another joint (mimic).
    """
    path = tree.description.path
    if not tip_name:
        raise BadValueError(
            "--tip", "", f"is missing, must be the link or frame of {path} that holds objects; {describe_ends(tree)}"
        )
    tip = tree.find_frame(tip_name, "--tip")
    if tip is None:
        raise BadValueError("--tip", "", f"is {tip_name!r}, which is not in {path}; {describe_ends(tree, tip_name)}")
    base = None
    if base_name is not None:
        frame = tree.find_frame(base_name, "--base")
        if frame is None:
            near = _suggest_frames(tree, base_name)
            raise BadValueError("--base", "", f"is {base_name!r}, which is not in {path}; {near}")
        base = frame.body()
        above = tree.list_above(tip.body())
        if base.index() not in [tip.body().index(), *(link.index() for link in above)]:
            names = ", ".join(link.name() for link in above)
            raise BadValueError(
                "--base", "", f"is {base_name!r}, which is not above {tip_name}, must be one of {names}"
            )
    elif (hand := _find_hand(tree, tip.body())) is not None:
        problem = f"is {tip_name!r}, which is on a finger of {hand.name()}, must be a link that no finger moves"
        raise BadValueError("--tip", "", f"{problem}: {hand.name()}? To import the finger as an arm, give a --base")
    chain = _climb_limb(tree, tip, base)
    if chain.obstacle is not None:
        joint, problem = chain.obstacle
        raise BadValueError(path, f"joint {joint.name()}", f"{problem}; it is on the chain from base to tip")
    if not chain.joints:
        where = f"between it and {chain.base.name()}"
        raise BadValueError("--tip", "", f"is {tip_name!r}, with no revolute joint {where}")
    return chain


def group_bodies(tree: RobotTree, chain: Chain) -> list[list[RigidBody]]:
    """Lists the bodies that move with each joint of a chain."""
    slots = {joint.child_body().index(): slot for slot, joint in enumerate(chain.joints)}
    groups: list[list[RigidBody]] = [[] for _ in chain.joints]
    for index in map(BodyIndex, range(1, tree.plant.num_bodies())):
        body = tree.plant.get_body(index)
        above = (link.index() for link in (body, *tree.list_above(body)))
        slot = next((slots[each] for each in above if each in slots), None)
        if slot is not None:
            groups[slot].append(body)
    return groups


def list_limbs(tree: RobotTree) -> list[dict[str, int]]:
    """Lists the ends of each limb with their number of arm joints, longest limbs first.

    Ends are links without a child link, and named frames. Links precede their sites. A hand is listed with its own
    link instead of its fingers.
    """
    links = [joint for joint in tree.joints_above.values() if joint.child_body().name() not in tree.description.sites]
    carriers = {joint.parent_body().index() for joint in links}
    found: dict[int, list[tuple[bool, str, int]]] = {}
    beyond: dict[int, int] = {}  # largest number of joints after each joint
    sites = tree.description.sites
    for frame in tree.list_frames():
        if frame.is_body_frame() and (frame.body().index() in carriers or frame.name() in sites):
            continue
        hand = _find_hand(tree, frame.body())
        limb = _climb_limb(tree, frame if hand is None else hand.body_frame())
        if limb.obstacle is None and len(limb.joints) >= FEWEST_JOINTS:
            # Hands come first, then massless links and named frames, which mark where tools are attached.
            rank = hand is None and frame.is_body_frame() and frame.body().default_mass() > 0.0
            name = str(frame.name() if hand is None else hand.name())
            found.setdefault(int(limb.joints[-1].index()), []).append((rank, name, len(limb.joints)))
            for count, joint in enumerate(reversed(limb.joints)):
                beyond[int(joint.index())] = max(count, beyond.get(int(joint.index()), 0))
    limbs = [
        {name: count for _, name, count in sorted(set(of_limb))}
        for last, of_limb in found.items()
        if beyond[last] <= 1  # skips cameras on a forearm; a jaw may follow an end
    ]
    return sorted(limbs, key=lambda limb: -max(limb.values()))


def list_ends(tree: RobotTree) -> dict[str, int]:
    """Lists the first ends of each limb with their number of arm joints (see ``list_limbs``)."""
    ends = {name: count for limb in list_limbs(tree) for name, count in list(limb.items())[:_OF_A_LIMB]}
    return dict(sorted(ends.items(), key=lambda item: -item[1]))


def choose_tip(tree: RobotTree) -> tuple[str, str]:
    """Chooses the tip of the longest limb, preferably a tool frame, otherwise the hand.

    Returns: Name of the tip, and a sentence that describes it and names the other ends. Both are empty if several
        limbs are equally long.
    """
    limbs = list_limbs(tree)
    # Revolute fingers form limbs of their own, which are ignored.
    limbs = [limb for limb in limbs if not all(map(_ASIDE.search, limb))] or limbs
    if not limbs or (len(limbs) > 1 and max(limbs[1].values()) == max(limbs[0].values())):
        return "", ""
    ends, sites = limbs[0], tree.description.sites
    names = [*ends, *(site for site, link in sites.items() if link in ends)]
    at_end = [name for name in names if not _ASIDE.search(name)] or names
    for_tools = [name for name in at_end if _FOR_TOOLS.search(name)]
    # Frames on the hand precede frames at its mount.
    tip = min(for_tools, key=lambda name: (not _is_on_hand(tree, name), *_rank_tool_frame(name)), default=at_end[0])
    link = sites.get(tip, tip)
    others = [name for name in names if name != tip]
    others += [name for limb in limbs[1:] for name in limb]
    more = f" and {len(others) - _LISTED} more" if len(others) > _LISTED else ""
    else_there = f"others are {', '.join(others[:_LISTED])}{more}" if others else "there are no others"
    jaws = [joint for joint in tree.joints_above.values() if not _find_obstacle(tree, joint) and _is_jaw(tree, joint)]
    jaws = [joint for joint in jaws if joint.parent_body().name() in (link, *ends)]
    taken = "".join(f"; {each.name()} moves a jaw and is frozen" for each in jaws)
    return tip, f"tip: {tip}, at the end of the longest limb ({ends[link]} joints){taken}; {else_there} (--tip)"


def _is_on_hand(tree: RobotTree, name: str) -> bool:
    """Returns True if a frame, other than a link's own frame, is fixed to a hand with fingers."""
    frame = next(frame for frame in tree.list_frames() if frame.name() == name)
    carriers = [] if frame.is_body_frame() else [frame.body()]
    for joint in tree.climb(frame.body()):
        if joint.num_velocities():
            break
        carriers.append(joint.parent_body())
    return any(joint.num_velocities() for body in carriers for joint in tree.list_children(body))


def _is_jaw(tree: RobotTree, joint: Joint) -> bool:
    """Returns True if a joint moves a gripper's jaw, judging from names or, for the last joint, from limits."""
    if not joint.num_velocities() or _TURNS.search(joint.name()):
        return False
    if _JAW.search(joint.child_body().name()):
        return True
    return _count_in_series(tree, joint) == 1 and (bool(_GRIPS.search(joint.name())) or _closes(tree, joint))


def _closes(tree: RobotTree, joint: Joint) -> bool:
    """Returns True if a joint rotates to one side only, and is much weaker than the joint above it."""
    above = next((each for each in tree.climb(joint.parent_body()) if each.num_velocities()), None)
    if above is None or not isinstance(joint, RevoluteJoint):
        return False
    low, high = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
    weak, strong = tree.note(joint).effort, tree.note(above).effort
    is_weak = weak is not None and strong is not None and weak <= _WEAK * strong
    return bool(is_weak and min(abs(low), abs(high)) <= _SHUT and high - low <= _OPEN)


def _rank_tool_frame(name: str) -> tuple[int, int]:
    """Ranks names of tool frames. A tool centre point precedes the flange that carries the gripper."""
    words = [k for k, word in enumerate(_TOOL_WORDS) if re.search(word, name, re.IGNORECASE)]
    return min(words, default=len(_TOOL_WORDS)), len(name)


def describe_ends(tree: RobotTree, near: str = "") -> str:
    """Describes the ends of limbs, optionally only ends with a name similar to ``near``."""
    ends = list_ends(tree)
    named = [*ends, *(site for site, link in tree.description.sites.items() if link in ends)]
    close = difflib.get_close_matches(near, named, n=3, cutoff=0.4) if near else []
    if close:
        return f"nearest: {', '.join(close)}"
    if not ends:
        frames = _suggest_frames(tree, near)
        no_arm = f"no limb has {FEWEST_JOINTS} revolute joints, so this is no arm unless --tip and --base name one"
        return f"{no_arm}; {frames}"
    listed = [f"{name} ({count} joints{_list_sites(tree, name)})" for name, count in list(ends.items())[:_LISTED]]
    return f"limbs end in {', '.join(listed)}" + (f" and {len(ends) - _LISTED} more" if len(ends) > _LISTED else "")


def _list_sites(tree: RobotTree, link: str) -> str:
    """Lists the first sites of a link, which can also be tips. Empty without sites."""
    sites = [site for site, carrier in tree.description.sites.items() if carrier == link]
    if not sites:
        return ""
    more = f" and {len(sites) - _OF_A_LIMB} more" if len(sites) > _OF_A_LIMB else ""
    return f"; sites {', '.join(sites[:_OF_A_LIMB])}{more}"


def _suggest_frames(tree: RobotTree, name: str) -> str:
    """Lists links and frames with similar names, otherwise the first few."""
    names = [str(frame.name()) for frame in tree.list_frames()]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    return f"nearest: {', '.join(dict.fromkeys(near))}" if near else f"it has {', '.join(names[:_LISTED])}"


def _climb_limb(tree: RobotTree, tip: Frame, base: RigidBody | None = None) -> Chain:
    """Collects the joints from a tip to a base, or to the upper end of the limb."""
    joints: list[RevoluteJoint] = []
    body = tip.body()

    def end(why: str, obstacle: tuple[Joint, str] | None = None, above: str = "") -> Chain:
        return Chain(body, tuple(joints), tip, why if base is None else "it was given", obstacle, above)

    for joint in tree.climb(body):
        if base is not None and body.index() == base.index():
            break
        for other in _list_others(tree, body, joints[0]) if base is None and joints else ():
            if _count_in_series(tree, other) >= _LIMB:
                return end(f"another limb branches off there, at {other.name()}")
        if joint.num_velocities():
            problem = _find_obstacle(tree, joint)
            if problem and base is None and len(joints) >= FEWEST_JOINTS:
                return end(f"the joint above it, {joint.name()}, {problem}", above=_describe_above(joint, problem))
            if problem:
                return end("", (joint, problem))
            assert isinstance(joint, RevoluteJoint)
            joints.insert(0, joint)
        body = joint.parent_body()
    if body.name() == "world" and joints:
        body = joints[0].parent_body()
    root = [body, *(link for link in tree.list_above(body) if link.name() != "world")][-1]
    above = ""
    if (floating := tree.description.floating.get(tree.key(root))) is not None:
        above = f"above them {floating} floats, but an arm may have only revolute joints"
    if root.index() == body.index():
        return end("it is the robot's root" if not above else f"the joint above it, {floating}, floats", above=above)
    return end(f"no joint between it and the robot's root, {root.name()}, moves", above=above)


def _find_hand(tree: RobotTree, body: RigidBody) -> RigidBody | None:
    """Finds the hand that carries a finger's body. Returns None for other bodies.

    A finger is carried by a limb with at least as many joints. It branches off together with other fingers, or at a
    joint where no arm can branch off, or its name is that of a single jaw.
    """
    finger = _climb_limb(tree, body.body_frame())
    jaw = next((joint for joint in tree.climb(body) if joint.num_velocities()), None)
    if jaw is not None and not _is_jaw(tree, jaw):
        jaw = None
    if jaw is not None:
        carrier = jaw.parent_body()
    elif finger.obstacle is not None:
        carrier = finger.obstacle[0].parent_body()
    elif not finger.joints:
        return None
    else:
        carrier, last = finger.base, finger.joints[-1]
        if len(finger.joints) > FEWEST_JOINTS and any(
            _count_in_series(tree, joint) for joint in _list_others(tree, last.parent_body(), last)
        ):
            carrier = last.parent_body()
    arm = _climb_limb(tree, carrier.body_frame())
    own = 0
    for joint in tree.climb(body):
        own += joint.num_velocities() > 0
        if joint.parent_body().index() == carrier.index():
            break
    further = _find_hand(tree, carrier) if carrier.index() != body.index() else None
    if arm.obstacle is not None or len(arm.joints) < FEWEST_JOINTS or len(arm.joints) < own:
        # The outer link of a finger is carried by the inner link, not by an arm.
        return None if jaw is None and finger.obstacle is None else further
    return further or carrier


def _find_obstacle(tree: RobotTree, joint: Joint) -> str:
    """Explains why a joint cannot belong to an arm. Empty if it can."""
    mimic = tree.note(joint).mimic
    if mimic is not None:
        how = f"follows {mimic.leader} (mimic)" if mimic.leader else "is fixed by an equality"
        return f"{how}, must move independently"
    if not isinstance(joint, RevoluteJoint):
        return f"is of type {joint.type_name()}, must be revolute"
    return ""


def _describe_above(joint: Joint, problem: str) -> str:
    """Describes an unsuitable moving joint above the arm."""
    how = _MOVES.get(joint.type_name(), problem.split(",")[0])
    return f"above them {joint.name()} {how}, but an arm may have only revolute joints"


def _list_others(tree: RobotTree, body: RigidBody, down: Joint) -> list[Joint]:
    """Lists the joints on a body, except the joint ``down``."""
    above = {down.index(), *(joint.index() for joint in tree.climb(down.parent_body()))}
    return [joint for joint in tree.list_children(body) if joint.index() not in above]


def _count_in_series(tree: RobotTree, joint: Joint) -> int:
    """Counts the moving joints on the longest path from a joint to a leaf, including this joint."""
    below = [_count_in_series(tree, other) for other in tree.list_children(joint.child_body())]
    return int(joint.num_velocities() > 0) + max(below, default=0)
