"""Options shared by commands, declared and checked in one place."""

import argparse
import json
import math
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from affordance.arguments import JOBS, REPEATS, check_number, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import LEARNERS
from affordance.exceptions import PROSE, AffordanceError, BadValueError, describe_choice, show_text
from affordance.files.atomic import to_plain, write_json, write_text
from affordance.files.constraints import SEEDS
from affordance.files.model_folder import MODELS
from affordance.memory.same_colours import SameColours, join_colours
from affordance.named_settings import change_settings, list_settings, parse_changes
from affordance.objects.colour import COLOUR_FORM, is_colour, parse_colour
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.robots.importer import AXES, ImportOptions, parse_values
from affordance.robots.xacro_file import parse_xacro
from affordance.settings import DEFAULT_SETTINGS, Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Bounds of shared numbers; values beyond any practical run are typing errors.
BOUNDS = {"repeats": REPEATS, "seed": SEEDS, "jobs": JOBS}


def add_repeats(parser: argparse.ArgumentParser, default: int | None, what: str, former: Sequence[str] = ()) -> None:
    """Adds ``--repeats`` with the name of what is repeated; earlier names still work and are not shown."""
    shown = what if default is None else f"{what} (default {default})"
    parser.add_argument("--repeats", type=int, default=default, metavar="N", help=shown)
    for name in former:
        parser.add_argument(name, type=int, dest="repeats", default=argparse.SUPPRESS, help=argparse.SUPPRESS)


def add_seed(parser: argparse.ArgumentParser, default: int = 0) -> None:
    """Adds ``--seed``."""
    help_ = f"root of every random draw (default {default})"
    parser.add_argument("--seed", type=int, default=default, metavar="N", help=help_)


def add_jobs(parser: argparse.ArgumentParser, default: int | None = None) -> None:
    """Adds ``--jobs``; by default one process per core."""
    shown = "one a core" if default is None else str(default)
    if default is None:
        import joblib  # here, as commands without this option need not wait for it

        default = joblib.cpu_count()
    parser.add_argument("--jobs", type=int, default=default, metavar="N", help=f"processes (default: {shown})")


def add_out(parser: argparse.ArgumentParser, default: str = "results", holds: str = "folder for the results") -> None:
    """Adds ``--out``."""
    help_ = f"{holds} (default {default}/)"
    parser.add_argument("--out", type=Path, default=Path(default), metavar="DIR", help=help_)


def add_models(parser: argparse.ArgumentParser, holds: str = "arm, materials and tools to use") -> None:
    """Adds ``--models``."""
    parser.add_argument("--models", type=Path, default=MODELS, metavar="DIR", help=f"folder with {holds}")


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Adds ``--robot``, with its former names ``--models`` and ``--arm``, and the options of a robot's file."""
    help_ = "folder that import-arm wrote, or a robot's file with --tip, imported once (default: the paper's arm)"
    parser.add_argument("--robot", type=Path, metavar="PATH", help=help_)
    for former in ("--models", "--arm"):
        parser.add_argument(former, type=Path, dest="robot", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    add_arm_arguments(parser)


def read_robot(arguments: argparse.Namespace) -> tuple[Path | None, ImportOptions, Path]:
    """Reads the robot, how its file is imported, and where imports are kept: ``arms`` in the results' folder."""
    out: Path | None = getattr(arguments, "out", None)
    return arguments.robot, read_options(arguments), (out or Path("results")) / "arms"


def add_set(
    parser: argparse.ArgumentParser,
    what: str = "a setting, as prior.sd=8000; more than once; affordance settings lists all",
) -> None:
    """Adds ``--set``, which changes settings by name."""
    parser.add_argument("--set", action="append", default=[], dest="changes", metavar="NAME=VALUE", help=what)


def add_learner(parser: argparse.ArgumentParser) -> None:
    """Adds ``--learner``; see ``read_changes``."""
    default = DEFAULT_SETTINGS.learner.name
    what = f"{', '.join(LEARNERS)}, or one's own as FILE.py:CLASS, a program that is run (default {default})"
    parser.add_argument("--learner", metavar="LEARNER", help=what)


def read_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Returns the changes of settings by name, of ``--set`` and of ``--learner`` if the command has it.

    A change in the wrong form, one that is made twice, or a learner that there is not raises a BadValueError.
    """
    changes = parse_changes(arguments.changes)
    if word := getattr(arguments, "learner", None):
        if "learner" in changes:
            raise BadValueError("--set", "learner", "is given with --learner, only one of them may be")
        changes["learner"] = load_learner(word)
    return changes


def add_prior_set(parser: argparse.ArgumentParser) -> None:
    """Adds ``--set`` of commands that use the prior's settings only; see ``read_prior``."""
    add_set(parser, "a setting of the prior, as prior.sd=8000; more than once")


def add_answer(parser: argparse.ArgumentParser, files: str) -> None:
    """Adds ``--json`` and ``--out``, a folder for the named files; see ``give_answer``."""
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"folder for {files} (default: none)")


def find_width() -> int:
    """Finds the width of the terminal, in characters; 0 where there is none, as in a pipe."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else 0


def give_answer(
    arguments: argparse.Namespace,
    name: str,
    text: str,
    content: Mapping[str, Any],
    draw: "Callable[[], Figure] | None" = None,
) -> None:
    """Prints an answer as text or JSON, and writes both to the folder of ``--out``, with a figure if it is drawn."""
    text = show_text(text, PROSE)
    if arguments.out is not None:
        write_text(arguments.out / f"{name}.txt", text + "\n")
        write_json(arguments.out / f"{name}.json", content)
        if draw is not None:
            from affordance.reporting.figures import save_figure  # here, as runs without --out need not wait for it

            save_figure(draw(), arguments.out, name)
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)


def add_run_options(
    parser: argparse.ArgumentParser,
    repeats: int | None,
    what: str,
    *,
    former: Sequence[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    models: str = "arm, materials and tools to use",
) -> None:
    """Adds the options of every command that simulates observers: repeats, seed, jobs, results, models and settings.

    A command without text on the folder of models takes a robot.
    """
    add_repeats(parser, repeats, what, former)
    add_seed(parser, seed)
    add_jobs(parser, jobs)
    add_out(parser)
    if models:
        add_models(parser, models)
    else:
        add_robot(parser)
    add_set(parser)


def check_bounds(arguments: argparse.Namespace) -> None:
    """Raises a BadValueError for a shared number out of bounds, or a folder of models that there is not."""
    for name, bound in BOUNDS.items():
        value = getattr(arguments, name, None)
        if value is not None:
            check_whole(f"--{name}", value, bound)
    models = getattr(arguments, "models", None)
    if models is not None and not models.is_dir():
        raise BadValueError("--models", "", f"is {str(models)!r}, which is not a folder")


def change_by_name(arguments: argparse.Namespace, settings: Settings = DEFAULT_SETTINGS) -> Settings:
    """Applies the changes of ``read_changes``; an unknown setting, or a wrong value, raises a BadValueError."""
    return change_settings(settings, read_changes(arguments))


def read_prior(arguments: argparse.Namespace, what: str) -> Prior:
    """Returns the prior with the changes of ``--set``; a change of any other setting raises a BadValueError."""
    groups = dict.fromkeys(each.name.partition(".")[0] for each in list_settings())
    refuse_changes(
        arguments, [name for name in groups if name != "prior"], f"of all settings {what} has the prior's only"
    )
    return change_by_name(arguments).prior


def refuse_changes(arguments: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Raises a BadValueError, with a reason, for a changed setting, or group, that a command does not use."""
    for name in parse_changes(arguments.changes):
        if any(name == each or name.startswith(f"{each}.") for each in names):
            raise BadValueError("--set", name, f"changes nothing here: {why}")


def add_arm_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments that describe an arm in a robot's file; shared by commands that import an arm."""
    add = parser.add_argument
    add("--tip", help="link or frame at the arm's end, where it holds things (default: the end of the longest limb)")
    add("--base", help="link that is fixed to the world (default: where the limb begins)")
    what = f"axis of the tip that points out of the hand: {', '.join(AXES)}; write --out-axis=-z"
    add("--out-axis", metavar="AXIS", help=what)
    what = "how the gripper is mounted: turn of the hand about its x from the tip's axes (default: z up at home)"
    add("--roll", type=float, metavar="DEGREES", help=what)
    what = "where other joints are frozen, and the arm's own at home (rad, m)"
    add("--posture", nargs="+", default=[], metavar="JOINT=VALUE", help=what)
    what = "of rotors and gears as felt at the joints (kg m^2): one for all, or JOINT=VALUE"
    add("--rotor-inertia", nargs="+", default=[], metavar="VALUE", help=what)
    what = "limits of torque in place of the file's (N m): one for all, or JOINT=VALUE"
    add("--effort", nargs="+", default=[], metavar="VALUE", help=what)
    what = "limits of velocity in place of the file's (rad/s): one for all, or JOINT=VALUE"
    add("--velocity", nargs="+", default=[], metavar="VALUE", help=what)
    add("--damping", choices=("file", "none"), default="file", help="the file's damping, or none")
    what = "replace impossible inertias by the nearest possible ones, even where that matters"
    add("--mend-inertia", action="store_true", help=what)
    what = "links whose weight an MJCF lets the simulator carry are refused, or carried by the motors (none)"
    add("--gravcomp", choices=("file", "none"), default="file", help=what)
    what = "arguments of a xacro template"
    add("--xacro", nargs="+", default=[], metavar="NAME:=VALUE", help=what)
    what = "folder of a package that a xacro template names, and that is not near it; more than once"
    add("--package", action="append", default=[], metavar="NAME=DIR", help=what)
    what = "expand a xacro template, which runs Python, even where the kernel cannot limit what it does"
    add("--trust-xacro", action="store_true", help=what)
    what = "axis of the robot's root that points up (default: z, unless the file's gravity says otherwise)"
    add("--up", metavar="AXIS", help=what)
    add("--base-height", type=float, metavar="METRES", help="of the base above the origin (default: the file's)")


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


def choose_tools(tools: Sequence[Tool], names: Sequence[str], path: Path) -> list[Tool]:
    """Selects tools by their names, or all; one that is unknown or has no grips raises an AffordanceError."""
    known = {tool.name: tool for tool in tools}
    for name in names:
        if name not in known:
            raise BadValueError(path, "--only", describe_choice(name, list(known)))
    chosen = [known[name] for name in names] or list(tools)
    for tool in chosen:
        if not tool.grips:
            raise AffordanceError(f"{path}: {tool.name} has no grips, must name those it can be held by")
    return chosen


def add_same_colours(parser: argparse.ArgumentParser) -> None:
    """Adds ``--same-colour``, for what two cameras see differently."""
    help_ = "colours that count as one, seen by two cameras, as #b5a642=#c0b050; more than once"
    parser.add_argument("--same-colour", action="append", default=[], metavar="A=B", help=help_)


def read_same_colours(arguments: argparse.Namespace, at_hand: Mapping[str, Material]) -> SameColours:
    """Reads pairs of colours, the first of each that of the material at hand, if it is of one.

    Anything else than colours, two materials at hand, or pairs without a memory raise a BadValueError.
    """
    pairs = []
    for word in arguments.same_colour:
        one, _, other = word.partition("=")
        if not (is_colour(one) and is_colour(other)):
            raise BadValueError("--same-colour", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
        pairs.append((parse_colour(one), parse_colour(other)))
    if pairs and not arguments.memory:
        raise BadValueError("--same-colour", "", "is of what is remembered, must come with --memory")
    return join_colours(pairs, {name: material.colour for name, material in at_hand.items()})
