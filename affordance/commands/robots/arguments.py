"""Arguments of the commands for robots."""

import argparse
from pathlib import Path

from affordance.commands.arguments import add_answer, add_json
from affordance.commands.parser import OUTPUT, ROBOT, find_group


def _add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments that describe the arm."""
    add = find_group(parser, ROBOT).add_argument
    add("--tip", help="link or frame at the end of the arm that holds objects (default: the end of the longest limb)")
    add("--base", help="link that is fixed to the world (default: the beginning of the limb)")
    what = "axis of the tip that points out of the hand: x, y, z, -x, -y, -z; for a negative one write --out-axis=-z"
    add("--out-axis", metavar="AXIS", help=what)
    what = "roll of the hand about its x axis, relative to the axes of the tip (default: z points up at home)"
    add("--roll", type=float, metavar="DEGREES", help=what)
    what = "joint positions (rad, m): positions of the arm's joints define its home, all other joints are fixed there"
    add("--posture", nargs="+", default=[], metavar="JOINT=VALUE", help=what)
    what = "inertia of rotors and gears reflected to the joints (kg m^2): one value for all, or JOINT=VALUE"
    add("--rotor-inertia", nargs="+", default=[], metavar="VALUE", help=what)
    what = "effort limits that replace the file's limits (N m): one value for all, or JOINT=VALUE"
    add("--effort", nargs="+", default=[], metavar="VALUE", help=what)
    what = "velocity limits that replace the file's limits (rad/s): one value for all, or JOINT=VALUE"
    add("--velocity", nargs="+", default=[], metavar="VALUE", help=what)
    add("--damping", choices=("file", "none"), default="file", help="joint damping: from the file, or none")
    what = "replace physically impossible inertias by the nearest possible values, even if this changes the motion"
    add("--mend-inertia", action="store_true", help=what)
    what = (
        "links whose weight the simulator compensates (MJCF): reject them (file), or let the motors carry them (none)"
    )
    add("--gravcomp", choices=("file", "none"), default="file", help=what)
    what = "folder of a package that a xacro template uses, if it is not found nearby; may be repeated"
    add("--package", action="append", default=[], metavar="NAME=DIR", help=what)
    what = "axis of the robot's root that points up (default: opposite to the file's gravity, else z)"
    add("--up", metavar="AXIS", help=what)
    what = "height of the base above the origin (default: the file's)"
    add("--base-height", type=float, metavar="METRES", help=what)


def declare_import_arm(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``import-arm``."""
    add = parser.add_argument
    add("file", type=Path, help="robot's file (URDF, SDF or MJCF), or a xacro template, which is a program")
    add("values", nargs="*", metavar="NAME:=VALUE", help="arguments of a xacro template")
    _add_arm_arguments(parser)
    add("--no-meshes", action="store_true", help="draw capsules instead of the robot's meshes")
    what = "adapt paths, blow and objects to what the arm can do (fit), or leave them (keep)"
    add("--tasks", choices=("fit", "keep"), default="fit", help=what)
    what = "folder for the models, which must be new or empty"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, required=True, metavar="DIR", help=what)
    add_json(parser)


def declare_compare_robots(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``compare-robots``."""
    add = parser.add_argument
    add("one", type=Path, metavar="A", help="a robot's file (URDF, SDF or MJCF), or a folder that import-arm wrote")
    add("other", type=Path, metavar="B", help="another file of the same robot")
    add("--tip", default="", metavar="NAME", help="end of the arm in A (default: the end of the longest limb)")
    add("--other-tip", default="", metavar="NAME", help="end of the arm in B (default: found in the same way)")
    add_answer(parser, "comparison.json and .txt")
