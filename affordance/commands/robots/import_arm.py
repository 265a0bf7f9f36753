"""``affordance import-arm``: makes a model folder for the arm in a robot's file."""

import argparse
import time
from pathlib import Path

from tqdm import tqdm

from affordance.commands.options import add_json, print_answer
from affordance.commands.parser import OUTPUT, find_group
from affordance.commands.robots.arm_options import add_arm_arguments, read_options
from affordance.commands.terminal import find_width
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.report import PAGE, TEXT
from affordance.reporting.formatting import break_line


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("file", type=Path, help="robot's file (URDF, SDF, MJCF or xacro)")
    add("values", nargs="*", metavar="NAME:=VALUE", help="arguments of a xacro template")
    add_arm_arguments(parser)
    add("--no-meshes", action="store_true", help="draw capsules instead of the robot's meshes")
    what = "adapt paths, blow and objects to what the arm can do (fit), or leave them (keep)"
    add("--tasks", choices=("fit", "keep"), default="fit", help=what)
    what = "folder for the models, which must be new or empty"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, required=True, metavar="DIR", help=what)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Imports an arm; returns the exit status."""
    start = time.perf_counter()
    with tqdm(bar_format="{desc} ({elapsed})", leave=False, disable=None) as steps:  # on a terminal only
        arguments.xacro = [*arguments.values, *arguments.xacro]
        lines = import_arm(
            arguments.file,
            read_options(arguments),
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
