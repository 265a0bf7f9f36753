"""``affordance import-arm``: converts any robot's file to a folder of models for its arm."""

import argparse
import time
from pathlib import Path

from tqdm import tqdm

from affordance.commands.options import add_arm_arguments, read_options
from affordance.robots.kept import import_arm
from affordance.robots.report import PAGE, TEXT


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("file", type=Path, help="the robot's file")
    add("values", nargs="*", metavar="NAME:=VALUE", help="arguments of a xacro template")
    add_arm_arguments(parser)
    add("--no-meshes", action="store_true", help="draw capsules in place of the robot's meshes")
    what = "whether paths, blow and objects are changed to what the arm can do"
    add("--tasks", choices=("fit", "keep"), default="fit", help=what)
    add("--out", type=Path, required=True, help="folder for the models; must be new or empty")


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
    print("\n".join(lines))
    print(f"{arguments.out}: written in {time.perf_counter() - start:.1f} s; see {PAGE} or {TEXT} there")
    return 0
