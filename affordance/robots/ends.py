"""Ends of a robot's limbs, which are what a tip can be; for those who do not know its names."""

import difflib

from affordance.robots.limbs import FEWEST_JOINTS, climb_limb, find_hand
from affordance.robots.tree import RobotTree

# Names listed at most: for one limb, and in all.
_OF_A_LIMB, _LISTED = 3, 12


def list_ends(tree: RobotTree) -> dict[str, int]:
    """Lists the ends of limbs, with the number of joints of the arm that each would end.

    They are links without another behind them and frames that the file names; of a hand its own link instead of its
    fingers.
    """
    carriers = {joint.parent_body().index() for joint in tree.joints_above.values()}
    frames = [f for f in tree.list_frames() if not f.is_body_frame() or f.body().index() not in carriers]
    found: dict[int, list[tuple[bool, str, int]]] = {}
    beyond: dict[int, int] = {}  # most joints that follow on one
    for frame in frames:
        hand = find_hand(tree, frame.body())
        limb = climb_limb(tree, hand or frame.body())
        if limb.obstacle is None and len(limb.joints) >= FEWEST_JOINTS:
            # First hands, then what weighs nothing and is there to be named.
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
    """Names the ends of limbs, or those nearest to a name."""
    ends = list_ends(tree)
    close = difflib.get_close_matches(near, ends, n=3, cutoff=0.4) if near else []
    if close:
        return f"nearest: {', '.join(close)}"
    if not ends:
        return f"no limb of it has {FEWEST_JOINTS} joints that turn; {suggest_frames(tree, near)}"
    listed = [f"{name} ({count} joints)" for name, count in list(ends.items())[:_LISTED]]
    return f"limbs end in {', '.join(listed)}" + (f" and {len(ends) - _LISTED} more" if len(ends) > _LISTED else "")


def suggest_frames(tree: RobotTree, name: str) -> str:
    """Names links and frames that are called almost so, or the first ones."""
    names = [str(frame.name()) for frame in tree.list_frames()]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    return f"nearest: {', '.join(dict.fromkeys(near))}" if near else f"it has {', '.join(names[:_LISTED])}"
