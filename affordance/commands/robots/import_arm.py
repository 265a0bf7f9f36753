"""``affordance import-arm``: writes a model folder for the arm in a robot's file."""

import argparse
import math
import time

from tqdm import tqdm

from affordance.arguments import check_number
from affordance.commands.answers import print_answer
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.robots.importer import ImportOptions, parse_values
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.report import PAGE, TEXT
from affordance.reporting.formatting import break_line


def run(arguments: argparse.Namespace) -> int:
    """Imports an arm and returns the exit status."""
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
    """Builds the options of an import from the arguments.

    Raises:
        BadValueError: An option is invalid.
    """
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
    """Splits words such as ``prefix:=left_`` at a sign.

    Raises:
        BadValueError: A word does not have this form.
    """
    pairs = [word.partition(sign) for word in words]
    if wrong := [word for word, pair in zip(words, pairs, strict=True) if not (pair[0] and pair[1])]:
        raise BadValueError(option, "", f"is {wrong[0]!r}, must be a name, {sign} and a value")
    return {name: value for name, _, value in pairs}
