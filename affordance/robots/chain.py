"""Joints of an arm, from its tip up to its base, and ends of limbs, which can serve as tip.

A limb is a series of joints up to the next branch; fingers are limbs at the end of another one.
"""

import difflib
import re
from typing import NamedTuple

from pydrake.multibody.tree import BodyIndex, Frame, Joint, RevoluteJoint, RigidBody

from affordance.exceptions import BadValueError
from affordance.robots.tree import RobotTree

# Fewest moving joints in series that count as another limb; a single one is a neck or a gripper's finger.
_LIMB = 2
# Fewest joints of an arm that may begin below an unsuitable joint; with fewer, that joint is rejected.
FEWEST_JOINTS = 3
# Words by which files name the frame where an arm holds things, the likeliest first (tool0 is ROS-Industrial's).
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
# Words by which files name what is mounted aside of it, or is a part of a gripper.
_ASIDE = re.compile("cam|sensor|optical|imu|finger|jaw|servo", re.IGNORECASE)
_FOR_TOOLS = re.compile("|".join(_TOOL_WORDS), re.IGNORECASE)
# Most names listed, for one limb and in total.
_OF_A_LIMB, _LISTED = 3, 12


# How joints move that do not turn, by Drake's names of their types.
_MOVES = {
    "prismatic": "slides",
    "quaternion_floating": "floats",
    "rpy_floating": "floats",
    "planar": "slides in a plane",
}


class Chain(NamedTuple):
    """Joints of an arm or limb."""

    base: RigidBody  # body at the upper end of the joints, which is fixed to the world
    joints: tuple[RevoluteJoint, ...]  # joints from base to tip, all revolute
    tip: Frame
    why_base: str  # reason for this base, in words
    # Unsuitable joint that ends the climb too early, and the reason; None for none.
    obstacle: tuple[Joint, str] | None = None
    above: str = ""  # what the joint above the base does, if it moves and cannot be the arm's, in words


def find_chain(tree: RobotTree, tip_name: str, base_name: str | None) -> Chain:
    """Finds the joints between tip and base.

    Without a base the arm begins below the first joint that slides or floats, or at the first link with another limb;
    otherwise at the robot's root. A BadValueError is raised for an unknown name, a tip on a finger, a base that is
    not above the tip, and a joint between them that is not revolute or follows another.
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
            near = _suggest_frames(tree, base_name)
            raise BadValueError("--base", "", f"is {base_name!r}, which {path} has not; {near}")
        base = frame.body()
        above = tree.list_above(tip.body())
        if base.index() not in [tip.body().index(), *(link.index() for link in above)]:
            names = ", ".join(link.name() for link in above)
            raise BadValueError("--base", "", f"is {base_name!r}, which is not above {tip_name}, must be of {names}")
    elif (hand := _find_hand(tree, tip.body())) is not None:
        problem = f"is {tip_name!r}, which is on a finger of {hand.name()}, must be a link that no finger moves"
        raise BadValueError("--tip", "", f"{problem}: {hand.name()}? A --base makes an arm of the finger")
    chain = _climb_limb(tree, tip, base)
    if chain.obstacle is not None:
        joint, problem = chain.obstacle
        raise BadValueError(path, f"joint {joint.name()}", f"{problem}; it is on the chain")
    if not chain.joints:
        where = f"between it and {chain.base.name()}"
        raise BadValueError("--tip", "", f"is {tip_name!r}, with no joint that turns {where}")
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
    """Lists the ends of each limb, with the number of joints of the arm up to each; the longest limbs come first.

    Ends are links without a child link and frames that the file names; links come before their sites, and a hand is
    listed by its own link, not by its fingers.
    """
    links = [joint for joint in tree.joints_above.values() if joint.child_body().name() not in tree.description.sites]
    carriers = {joint.parent_body().index() for joint in links}
    found: dict[int, list[tuple[bool, str, int]]] = {}
    beyond: dict[int, int] = {}  # largest number of joints beyond each joint
    sites = tree.description.sites
    for frame in tree.list_frames():
        if frame.is_body_frame() and (frame.body().index() in carriers or frame.name() in sites):
            continue
        hand = _find_hand(tree, frame.body())
        limb = _climb_limb(tree, frame if hand is None else hand.body_frame())
        if limb.obstacle is None and len(limb.joints) >= FEWEST_JOINTS:
            # Hands first, then massless links and named frames, which mark places for tools.
            rank = hand is None and frame.is_body_frame() and frame.body().default_mass() > 0.0
            name = str(frame.name() if hand is None else hand.name())
            found.setdefault(int(limb.joints[-1].index()), []).append((rank, name, len(limb.joints)))
            for count, joint in enumerate(reversed(limb.joints)):
                beyond[int(joint.index())] = max(count, beyond.get(int(joint.index()), 0))
    limbs = [
        {name: count for _, name, count in sorted(set(of_limb))}
        for last, of_limb in found.items()
        if beyond[last] <= 1  # a camera on a forearm is not the end of a limb; a jaw may follow the end
    ]
    return sorted(limbs, key=lambda limb: -max(limb.values()))


def list_ends(tree: RobotTree) -> dict[str, int]:
    """Lists the first ends of limbs, with the number of joints of the arm up to each; see ``list_limbs``."""
    ends = {name: count for limb in list_limbs(tree) for name, count in list(limb.items())[:_OF_A_LIMB]}
    return dict(sorted(ends.items(), key=lambda item: -item[1]))


def choose_tip(tree: RobotTree) -> tuple[str, str]:
    """Chooses the tip of the longest limb, if one is longer than all others: a frame for tools, else its hand.

    Returns: Name of the tip, and a sentence that says what it is and what else there is; both empty if no limb is the
        longest.
    """
    limbs = list_limbs(tree)
    # A finger that turns ends a limb of its own; its hand ends another.
    limbs = [limb for limb in limbs if not all(map(_ASIDE.search, limb))] or limbs
    if not limbs or (len(limbs) > 1 and max(limbs[1].values()) == max(limbs[0].values())):
        return "", ""
    ends, sites = limbs[0], tree.description.sites
    names = [*ends, *(site for site, link in sites.items() if link in ends)]
    at_end = [name for name in names if not _ASIDE.search(name)] or names
    for_tools = [name for name in at_end if _FOR_TOOLS.search(name)]
    tip = min(for_tools, key=_rank_tool_frame) if for_tools else at_end[0]
    link = sites.get(tip, tip)
    others = [name for name in names if name != tip]
    others += [name for limb in limbs[1:] for name in limb]
    more = f" and {len(others) - _LISTED} more" if len(others) > _LISTED else ""
    else_there = f"others are {', '.join(others[:_LISTED])}{more}" if others else "there is no other"
    return tip, f"tip: {tip}, at the end of the longest limb ({ends[link]} joints); {else_there} (--tip)"


def _rank_tool_frame(name: str) -> tuple[int, int]:
    """Ranks names of frames for tools: a tool centre point before the flange that carries the gripper."""
    words = [k for k, word in enumerate(_TOOL_WORDS) if re.search(word, name, re.IGNORECASE)]
    return min(words, default=len(_TOOL_WORDS)), len(name)


def describe_ends(tree: RobotTree, near: str = "") -> str:
    """Describes the ends of limbs, or those with names nearest to a given one."""
    ends = list_ends(tree)
    named = [*ends, *(site for site, link in tree.description.sites.items() if link in ends)]
    close = difflib.get_close_matches(near, named, n=3, cutoff=0.4) if near else []
    if close:
        return f"nearest: {', '.join(close)}"
    if not ends:
        frames = _suggest_frames(tree, near)
        no_arm = f"no limb of it has {FEWEST_JOINTS} joints that turn: it is no arm, unless --tip and --base name one"
        return f"{no_arm}; {frames}"
    listed = [f"{name} ({count} joints{_list_sites(tree, name)})" for name, count in list(ends.items())[:_LISTED]]
    return f"limbs end in {', '.join(listed)}" + (f" and {len(ends) - _LISTED} more" if len(ends) > _LISTED else "")


def _list_sites(tree: RobotTree, link: str) -> str:
    """Lists the first sites of a link, each of which can be a tip too; empty if it has none."""
    sites = [site for site, carrier in tree.description.sites.items() if carrier == link]
    if not sites:
        return ""
    more = f" and {len(sites) - _OF_A_LIMB} more" if len(sites) > _OF_A_LIMB else ""
    return f"; sites {', '.join(sites[:_OF_A_LIMB])}{more}"


def _suggest_frames(tree: RobotTree, name: str) -> str:
    """Describes links and frames with similar names, or the first ones."""
    names = [str(frame.name()) for frame in tree.list_frames()]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    return f"nearest: {', '.join(dict.fromkeys(near))}" if near else f"it has {', '.join(names[:_LISTED])}"


def _climb_limb(tree: RobotTree, tip: Frame, base: RigidBody | None = None) -> Chain:
    """Collects the joints from a tip up to a base above it, or to the upper end of the limb."""
    joints: list[RevoluteJoint] = []
    body = tip.body()

    def end(why: str, obstacle: tuple[Joint, str] | None = None, above: str = "") -> Chain:
        return Chain(body, tuple(joints), tip, why if base is None else "it was given", obstacle, above)

    for joint in tree.climb(body):
        if base is not None and body.index() == base.index():
            break
        for other in _list_others(tree, body, joints[0]) if base is None and joints else ():
            if _count_in_series(tree, other) >= _LIMB:
                return end(f"another limb leaves from it, by {other.name()}")
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
        above = f"above them {floating} floats, and an arm here has joints that turn only"
    if root.index() == body.index():
        return end("it is the robot's root" if not above else f"the joint above it, {floating}, floats", above=above)
    return end(f"no joint above it moves, up to the robot's root, {root.name()}", above=above)


def _find_hand(tree: RobotTree, body: RigidBody) -> RigidBody | None:
    """Finds the link that carries the finger of a body; None if the body is not on a finger.

    A finger is carried by a limb with at least as many joints, and branches off with other fingers or by a joint that
    is unsuitable for an arm.
    """
    finger = _climb_limb(tree, body.body_frame())
    if finger.obstacle is not None:
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
    if arm.obstacle is not None or len(arm.joints) < FEWEST_JOINTS or len(arm.joints) < own:
        return None
    return _find_hand(tree, carrier) or carrier


def _find_obstacle(tree: RobotTree, joint: Joint) -> str:
    """Describes why a joint cannot belong to the arm; empty if it can."""
    mimic = tree.note(joint).mimic
    if mimic is not None:
        how = f"follows {mimic.leader} (mimic)" if mimic.leader else "is fixed by an equality"
        return f"{how}, must move on its own"
    if not isinstance(joint, RevoluteJoint):
        return f"is of type {joint.type_name()}, must be revolute"
    return ""


def _describe_above(joint: Joint, problem: str) -> str:
    """Describes what a joint above the arm does, which no joint of an arm may."""
    how = _MOVES.get(joint.type_name(), problem.split(",")[0])
    return f"above them {joint.name()} {how}, and an arm here has joints that turn only"


def _list_others(tree: RobotTree, body: RigidBody, down: Joint) -> list[Joint]:
    """Lists the joints on a body that do not lead to a joint below it."""
    above = {down.index(), *(joint.index() for joint in tree.climb(down.parent_body()))}
    return [joint for joint in tree.list_children(body) if joint.index() not in above]


def _count_in_series(tree: RobotTree, joint: Joint) -> int:
    """Counts the moving joints on the longest path down from a joint, including it."""
    below = [_count_in_series(tree, other) for other in tree.list_children(joint.child_body())]
    return int(joint.num_velocities() > 0) + max(below, default=0)
