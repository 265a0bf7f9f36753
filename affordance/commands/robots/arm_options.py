"""Options that describe an arm in a robot's file."""

import argparse
import math

from affordance.arguments import check_number
from affordance.commands.parser import ROBOT, find_group
from affordance.extensions.robots.importer import AXES, ImportOptions, parse_values
from affordance.extensions.robots.xacro_file import parse_xacro


def add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments that describe an arm in a robot's file; shared by commands that import an arm."""
    add = find_group(parser, ROBOT).add_argument
    add("--tip", help="link or frame at the end of the arm that holds objects (default: the end of the longest limb)")
    add("--base", help="link that is fixed to the world (default: the beginning of the limb)")
    what = f"axis of the tip that points out of the hand: {', '.join(AXES)}; for a negative one write --out-axis=-z"
    add("--out-axis", metavar="AXIS", help=what)
    what = "roll of the hand about its x axis, relative to the axes of the tip (default: z points up at home)"
    add("--roll", type=float, metavar="DEGREES", help=what)
    what = "joint positions (rad, m): those of the arm define its home, all other joints are frozen there"
    add("--posture", nargs="+", default=[], metavar="JOINT=VALUE", help=what)
    what = "inertia of rotors and gears reflected to the joints (kg m^2): one value for all, or JOINT=VALUE"
    add("--rotor-inertia", nargs="+", default=[], metavar="VALUE", help=what)
    what = "effort limits that replace those of the file (N m): one value for all, or JOINT=VALUE"
    add("--effort", nargs="+", default=[], metavar="VALUE", help=what)
    what = "velocity limits that replace those of the file (rad/s): one value for all, or JOINT=VALUE"
    add("--velocity", nargs="+", default=[], metavar="VALUE", help=what)
    add("--damping", choices=("file", "none"), default="file", help="joint damping: that of the file, or none")
    what = "replace physically impossible inertias by the nearest possible ones, even where that changes the motion"
    add("--mend-inertia", action="store_true", help=what)
    what = (
        "links whose weight the simulator compensates (MJCF): refuse them (file), or let the motors carry them (none)"
    )
    add("--gravcomp", choices=("file", "none"), default="file", help=what)
    what = "arguments of a xacro template"
    add("--xacro", nargs="+", default=[], metavar="NAME:=VALUE", help=what)
    what = "folder of a package that a xacro template uses, if it is not found nearby; may be repeated"
    add("--package", action="append", default=[], metavar="NAME=DIR", help=what)
    what = "expand a xacro template, which runs Python code, even if the kernel cannot confine it"
    add("--trust-xacro", action="store_true", help=what)
    what = "axis of the robot's root that points up (default: opposite to the file's gravity, else z)"
    add("--up", metavar="AXIS", help=what)
    what = "height of the base above the origin (default: the file's)"
    add("--base-height", type=float, metavar="METRES", help=what)


def read_options(arguments: argparse.Namespace) -> ImportOptions:
    """Builds options from the arguments that ``add_arm_arguments`` adds; an invalid one raises a BadValueError."""
    return ImportOptions(
        tip=arguments.tip or "",
        base=arguments.base,
        out_axis=arguments.out_axis,
        roll=None if arguments.roll is None else math.radians(check_number("--roll", arguments.roll, -360.0, 360.0)),
        posture=parse_values("--posture", arguments.posture),
        rotor_inertia=parse_values("--rotor-inertia", arguments.rotor_inertia, unit="kg m^2"),
        effort=parse_values("--effort", arguments.effort, unit="N m", may_be_zero=False),
        velocity=parse_values("--velocity", arguments.velocity, unit="rad/s", may_be_zero=False),
        damping=arguments.damping == "file",
        mend_inertia=arguments.mend_inertia,
        gravcomp=arguments.gravcomp == "file",
        xacro=parse_xacro(arguments.xacro, arguments.package, trusts=arguments.trust_xacro),
        height=arguments.base_height,
        up=arguments.up,
    )
