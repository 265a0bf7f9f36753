"""Ends of a robot's limbs, which can serve as tip; listed for users who do not know their names."""

import difflib

from affordance.robots.limbs import FEWEST_JOINTS, climb_limb, find_hand
from affordance.robots.tree import RobotTree

# Most names listed, for one limb and in total.
_OF_A_LIMB, _LISTED = 3, 12


def list_ends(tree: RobotTree) -> dict[str, int]:
    """Lists the ends of limbs, with the number of joints of the arm up to each.

    Ends are links without a child link and frames that the file names; a hand is listed by its own link, not
    by its fingers.
    """
    carriers = {joint.parent_body().index() for joint in tree.joints_above.values()}
    frames = [f for f in tree.list_frames() if not f.is_body_frame() or f.body().index() not in carriers]
    found: dict[int, list[tuple[bool, str, int]]] = {}
    beyond: dict[int, int] = {}  # largest number of joints beyond each joint
    for frame in frames:
        hand = find_hand(tree, frame.body())
        limb = climb_limb(tree, hand or frame.body())
        if limb.obstacle is None and len(limb.joints) >= FEWEST_JOINTS:
            # Hands first, then massless links and named frames, which mark places for tools.
            rank = hand is None and frame.is_body_frame() and frame.body().default_mass() > 0.0
            name = str(frame.name() if hand is None else hand.name())
            found.setdefault(int(limb.joints[-1].index()), []).append((rank, name, len(limb.joints)))
            for count, joint in enumerate(reversed(limb.joints)):
                beyond[int(joint.index())] = max(count, beyond.get(int(joint.index()), 0))
    ends = {
        name: count
        for last, of_limb in found.items()
        if beyond[last] <= 1  # a camera on a forearm is not the end of a limb; a jaw may follow the end
        for _, name, count in sorted(set(of_limb))[:_OF_A_LIMB]
    }
    return dict(sorted(ends.items(), key=lambda item: -item[1]))


def describe_ends(tree: RobotTree, near: str = "") -> str:
    """Describes the ends of limbs, or those with names nearest to a given one."""
    ends = list_ends(tree)
    close = difflib.get_close_matches(near, ends, n=3, cutoff=0.4) if near else []
    if close:
        return f"nearest: {', '.join(close)}"
    if not ends:
        return f"no limb of it has {FEWEST_JOINTS} joints that turn; {suggest_frames(tree, near)}"
    listed = [f"{name} ({count} joints)" for name, count in list(ends.items())[:_LISTED]]
    return f"limbs end in {', '.join(listed)}" + (f" and {len(ends) - _LISTED} more" if len(ends) > _LISTED else "")


def suggest_frames(tree: RobotTree, name: str) -> str:
    """Describes links and frames with similar names, or the first ones."""
    names = [str(frame.name()) for frame in tree.list_frames()]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    return f"nearest: {', '.join(dict.fromkeys(near))}" if near else f"it has {', '.join(names[:_LISTED])}"
