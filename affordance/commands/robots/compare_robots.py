"""``affordance compare-robots A B``: compares two files of one robot, joint by joint."""

import argparse
import math
from dataclasses import asdict
from pathlib import Path

from affordance.commands.options import add_answer, give_answer
from affordance.commands.terminal import find_width
from affordance.extensions.robots.comparison import NAMES, TOLERANCE, Compared, compare, read_joints
from affordance.reporting.formatting import break_line, format_number, tabulate_within

# Exit status if the files differ.
DIFFERENT = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("one", type=Path, metavar="A", help="a robot's file (URDF, SDF or MJCF)")
    add("other", type=Path, metavar="B", help="another file of the same robot")
    add("--tip", default="", metavar="NAME", help="end of the arm in A (default: the end of the longest limb)")
    add("--other-tip", default="", metavar="NAME", help="end of the arm in B (default: found in the same way)")
    add_answer(parser, "comparison.json and .txt")


def run(arguments: argparse.Namespace) -> int:
    """Prints the comparison and returns the exit status: DIFFERENT if anything differs, else 0."""
    one, other = read_joints(arguments.one, arguments.tip), read_joints(arguments.other, arguments.other_tip)
    compared = compare(one, other)
    differing = [name for name in NAMES if any(name in each.differing for each in compared)]
    masses = [sum(each.mass for each in joints) for joints in (one, other)]
    weights = f"{format_number(masses[0])} and {format_number(masses[1])} kg"
    if differing:
        where = "; ".join(f"{NAMES[name]} of {_list_joints(compared, name)}" for name in differing)
        sentence = f"The arms differ ({weights}): {where}."
    else:
        sentence = f"The arms agree to {100.0 * TOLERANCE:g} % ({weights}, {len(one)} joints)."
    rows = [["", *(NAMES[name] for name in NAMES)]]
    for each in compared:
        name = each.one.joint if each.one.joint == each.other.joint else f"{each.one.joint} / {each.other.joint}"
        rows.append([name, *(_show(each, key) for key in NAMES)])
    order = [1 + k for k, name in reversed(list(enumerate(NAMES))) if name not in differing]
    lines = tabulate_within(rows, find_width(), order)
    content = {
        "differing": differing,
        "masses": masses,
        "joints": [
            {"one": _list_finite(each.one), "other": _list_finite(each.other), "differing": each.differing}
            for each in compared
        ],
        "sentence": sentence,
    }
    give_answer(arguments, "comparison", "\n".join([*break_line(sentence, find_width()), *lines]), content)
    return DIFFERENT if differing else 0


def _list_joints(compared: list[Compared], name: str) -> str:
    return ", ".join(each.one.joint for each in compared if name in each.differing)


def _show(each: Compared, name: str) -> str:
    """Formats one property of both joints, as a single number if they agree."""
    a, b = (float(getattr(joint, name)) for joint in (each.one, each.other))
    shown = [format_number(value) if math.isfinite(value) else "none" for value in (a, b)]
    return f"{shown[0]} | {shown[1]}" if name in each.differing else shown[0]


def _list_finite(joint: object) -> dict[str, object]:
    values = asdict(joint)  # type: ignore[call-overload]
    return {name: None if isinstance(value, float) and math.isinf(value) else value for name, value in values.items()}
