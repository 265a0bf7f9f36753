"""``affordance import-arm``: converts any robot's file to a folder of models for its arm."""

import argparse
import time
from pathlib import Path

from affordance.robots.frozen import parse_values
from affordance.robots.importer import AXES, ImportOptions, parse_spread
from affordance.robots.kept import import_arm
from affordance.robots.report import PAGE, TEXT

HELP = "make a folder of models for the arm of a robot's file (URDF, SDF or MJCF)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("file", type=Path, help="the robot's file")
    add_arm_arguments(parser)
    parser.add_argument("--no-meshes", action="store_true", help="draw capsules in place of the robot's meshes")
    parser.add_argument(
        "--tasks",
        choices=("fit", "keep"),
        default="fit",
        help="whether path, blow and objects are changed to what the arm can do",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for the models; must be new or empty")


def add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments that describe an arm in a robot's file; shared by commands that import an arm."""
    parser.add_argument(
        "--tip", help="link or frame at the arm's end, where it holds things; without it they are listed"
    )
    parser.add_argument("--base", help="link that is fixed to the world (default: where the limb begins)")
    parser.add_argument(
        "--out-axis",
        metavar="AXIS",
        help=f"axis of the tip that points out of the hand: {', '.join(AXES)}; write --out-axis=-z",
    )
    parser.add_argument(
        "--posture",
        nargs="+",
        default=[],
        metavar="JOINT=VALUE",
        help="where other joints are frozen, and the arm's own at home (rad, m)",
    )
    parser.add_argument(
        "--rotor-inertia",
        nargs="+",
        default=[],
        metavar="VALUE",
        help="of rotors and gears as felt at the joints (kg m^2): one for all, or JOINT=VALUE",
    )
    parser.add_argument(
        "--effort",
        nargs="+",
        default=[],
        metavar="VALUE",
        help="limits of torque in place of the file's (N m): one for all, or JOINT=VALUE",
    )
    parser.add_argument("--damping", choices=("file", "none"), default="file", help="the file's damping, or none")
    parser.add_argument(
        "--up", default="z", metavar="AXIS", help="axis of the robot's root that points up (default z)"
    )
    parser.add_argument(
        "--base-height", type=float, metavar="METRES", help="of the base above the origin (default: the file's)"
    )


def read_options(arguments: argparse.Namespace) -> ImportOptions:
    """Builds options from the arguments that ``add_arm_arguments`` adds.

    Raises:
        BadValueError: One of them is invalid.
    """
    return ImportOptions(
        tip=arguments.tip or "",
        base=arguments.base,
        out_axis=arguments.out_axis,
        posture=parse_values("--posture", arguments.posture),
        rotor_inertia=parse_spread("--rotor-inertia", arguments.rotor_inertia, unit="kg m^2", may_be_zero=True),
        effort=parse_spread("--effort", arguments.effort, unit="N m", may_be_zero=False),
        damping=arguments.damping == "file",
        height=arguments.base_height,
        up=arguments.up,
    )


def run(arguments: argparse.Namespace) -> int:
    """Imports an arm; returns the exit status.

    Raises:
        AffordanceError: The file or an argument is invalid or incomplete; nothing was written.
    """
    start = time.perf_counter()
    lines = import_arm(
        arguments.file,
        read_options(arguments),
        arguments.out,
        with_meshes=not arguments.no_meshes,
        fits_tasks=arguments.tasks == "fit",
    )
    print("\n".join(lines))
    print(f"{arguments.out}: written in {time.perf_counter() - start:.1f} s; see {PAGE} or {TEXT} there")
    return 0
