"""Ends of a robot's limbs, which are what a tip can be; for those who do not know its names."""

import difflib

from pydrake.multibody.tree import RigidBody

from affordance.robots.limbs import FEWEST_JOINTS, climb_limb, find_hand
from affordance.robots.tree import RobotTree

# How many names are listed: of the ends of one limb, and in all.
_OF_A_LIMB, _LISTED = 3, 12


def list_ends(tree: RobotTree) -> dict[str, int]:
    """Lists the ends of limbs, with the number of joints of the arm that each would end.

    They are links without another behind them and frames that the file names; of a hand its own link instead of its
    fingers.
    """
    carriers = {joint.parent_body().index() for joint in tree.joints_above.values()}
    frames = [
        frame for frame in tree.list_frames() if not frame.is_body_frame() or not _carries(frame.body(), carriers)
    ]
    found: dict[int, dict[str, int]] = {}
    # Massless ones first: they are there to be named.
    for frame in sorted(frames, key=lambda frame: frame.is_body_frame() and frame.body().default_mass() > 0.0):
        hand = find_hand(tree, frame.body())
        limb = climb_limb(tree, hand or frame.body())
        if limb.obstacle is None and len(limb.joints) >= FEWEST_JOINTS:
            of_limb = found.setdefault(int(limb.joints[-1].index()), {})
            of_limb[str(frame.name() if hand is None else hand.name())] = len(limb.joints)
    ends = [item for of_limb in found.values() for item in list(of_limb.items())[:_OF_A_LIMB]]
    return dict(sorted(ends, key=lambda item: -item[1]))


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


def _carries(body: RigidBody, carriers: set[object]) -> bool:
    return body.index() in carriers
