"""``affordance compare-robots A B``: compares two files of the same robot, joint by joint."""

import argparse
import math
from collections.abc import Sequence

from affordance.commands.answers import give_answer
from affordance.commands.terminal import find_width
from affordance.extensions.robots.comparison import (
    NAMES,
    POSTURES,
    STATED,
    TOLERANCE,
    Compared,
    JointData,
    compare,
    read_joints,
)
from affordance.reporting.formatting import break_line, format_number, tabulate_within

# Exit status if the files differ.
DIFFERENT = 3


def run(arguments: argparse.Namespace) -> int:
    """Prints the comparison and returns the exit status: DIFFERENT if anything differs, else 0."""
    arms = read_joints(arguments.one, arguments.tip), read_joints(arguments.other, arguments.other_tip)
    found = compare(*arms, same_tip=bool(arguments.tip and arguments.other_tip))
    differing = [name for name in NAMES if any(name in each.differing for each in found.joints)]
    masses = [sum(each.mass for each in arm.joints) for arm in arms]
    weights = f"{format_number(masses[0])} and {format_number(masses[1])} kg, {len(found.joints)} joints"
    if found.differs:
        where = "; ".join(_describe(found.joints, name) for name in differing)
        sentence = f"The arms differ ({weights}){f': {where}' if where else ''}."
    else:
        sentence = f"The arms agree to {100.0 * TOLERANCE:g} % ({weights})."
    largest = [format_number(100.0 * each, 2) for each in (found.mass_matrix, found.gravity)]
    sentence += (
        f" At {POSTURES} random postures, mass matrices differ by up to {largest[0]} %, torques of gravity by up to "
        f"{largest[1]} %."
    )
    rotors = [joint.rotor for arm in arms for joint in arm.joints]
    shown = [name for name in NAMES if name in differing or (name in STATED and (name != "rotor" or any(rotors)))]
    rows = [["", *(f"{NAMES[name]}{'' if name in STATED else ' apart'}" for name in shown)]]
    for each in found.joints:
        name = each.one.joint if each.one.joint == each.other.joint else f"{each.one.joint} / {each.other.joint}"
        rows.append([name, *(_show(each, key) for key in shown)])
    order = [1 + k for k, name in reversed(list(enumerate(shown))) if name not in differing]
    lines = tabulate_within(rows, find_width(), order)
    remarks = [part for remark in found.remarks for part in break_line(f"remark: {remark}", find_width())]
    content = {
        "differing": differing,
        "masses": masses,
        "mass_matrix": found.mass_matrix,
        "gravity": found.gravity,
        "joints": [
            {
                "one": _list_stated(each.one),
                "other": _list_stated(each.other),
                "apart": each.apart,
                "differing": each.differing,
            }
            for each in found.joints
        ],
        "remarks": found.remarks,
        "sentence": sentence,
    }
    text = "\n".join([*break_line(sentence, find_width()), *remarks, *lines])
    give_answer(arguments, "comparison", text, content)
    return DIFFERENT if found.differs else 0


def _describe(compared: Sequence[Compared], name: str) -> str:
    """Describes which joints differ, with the size of the difference or both values."""
    what, _, unit = NAMES[name].rstrip(")").partition(" (")
    differing = [each for each in compared if name in each.differing]
    return f"{what} of " + ", ".join(f"{each.one.joint} ({_show(each, name)} {unit})" for each in differing)


def _show(each: Compared, name: str) -> str:
    """Formats a quantity of both joints: equal values once, and a difference only if it is more than rounding."""
    if name not in STATED:
        return format_number(each.apart[name], 2) if name in each.differing else ""
    shown = [_show_stated(getattr(joint, name)) for joint in (each.one, each.other)]
    return f"{shown[0]} | {shown[1]}" if name in each.differing else next(filter(None, shown), "")


def _show_stated(value: float | None) -> str:
    if value is None:
        return ""
    return format_number(value) if math.isfinite(value) else "none"


def _list_stated(joint: JointData) -> dict[str, object]:
    values = {name: getattr(joint, name) for name in STATED}
    finite = {name: None if value is None or math.isinf(value) else value for name, value in values.items()}
    return {"joint": joint.joint, **finite}
