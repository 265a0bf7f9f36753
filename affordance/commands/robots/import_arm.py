"""``affordance import-arm``: makes a model folder for the arm in a robot's file."""

import argparse
import math
import time
from pathlib import Path

from tqdm import tqdm

from affordance.arguments import check_number
from affordance.commands.options import add_json, print_answer
from affordance.commands.parser import OUTPUT, ROBOT, find_group
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.robots.importer import AXES, ImportOptions, parse_values
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.report import PAGE, TEXT
from affordance.reporting.formatting import break_line


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
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


def _add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments that describe the arm."""
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
    what = "folder of a package that a xacro template uses, if it is not found nearby; may be repeated"
    add("--package", action="append", default=[], metavar="NAME=DIR", help=what)
    what = "axis of the robot's root that points up (default: opposite to the file's gravity, else z)"
    add("--up", metavar="AXIS", help=what)
    what = "height of the base above the origin (default: the file's)"
    add("--base-height", type=float, metavar="METRES", help=what)


def run(arguments: argparse.Namespace) -> int:
    """Imports an arm; returns the exit status."""
    start = time.perf_counter()
    with tqdm(bar_format="{desc} ({elapsed})", leave=False, disable=None) as steps:  # on a terminal only
        lines = import_arm(
            arguments.file,
            _read_options(arguments),
            arguments.out,
            with_meshes=not arguments.no_meshes,
            fits_tasks=arguments.tasks == "fit",
            tell=steps.set_description_str,
        )
    took = time.perf_counter() - start
    folded = [part for line in lines for part in break_line(line, find_width())]
    text = "\n".join([*folded, f"{arguments.out}: written in {took:.1f} s; see {PAGE} or {TEXT} there"])
    print_answer(
        arguments, text, {"folder": str(arguments.out), "report": str(arguments.out / PAGE), "findings": lines}
    )
    return 0


def _read_options(arguments: argparse.Namespace) -> ImportOptions:
    """Builds options from the arguments; an invalid one raises a BadValueError."""
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
        xacro=_split("NAME:=VALUE", arguments.values, ":="),
        packages=_split("--package", arguments.package, "="),
        height=arguments.base_height,
        up=arguments.up,
    )


def _split(option: str, words: list[str], sign: str) -> dict[str, str]:
    """Splits words such as ``prefix:=left_`` at a sign; a word without it raises a BadValueError."""
    pairs = [word.partition(sign) for word in words]
    if wrong := [word for word, pair in zip(words, pairs, strict=True) if not (pair[0] and pair[1])]:
        raise BadValueError(option, "", f"is {wrong[0]!r}, must be a name, {sign} and a value")
    return {name: value for name, _, value in pairs}
