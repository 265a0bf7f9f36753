"""Options shared by commands, declared and checked in one place."""

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from affordance.arguments import JOBS, REPEATS, check_number, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.learner_file import load_learner
from affordance.belief.learners import LEARNERS, RIVALS
from affordance.commands.parser import OUTPUT, ROBOT, find_group
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

# Bounds of shared numbers. A value beyond any practical run is probably a typing error.
BOUNDS = {"repeats": REPEATS, "seed": SEEDS, "jobs": JOBS}


def add_repeats(parser: argparse.ArgumentParser, default: int | None, what: str, former: Sequence[str] = ()) -> None:
    """Adds ``--repeats``, whose help names what is repeated; former names still work but are hidden."""
    shown = what if default is None else f"{what} (default {default})"
    parser.add_argument("--repeats", type=int, default=default, metavar="N", help=shown)
    for name in former:
        parser.add_argument(name, type=int, dest="repeats", default=argparse.SUPPRESS, help=argparse.SUPPRESS)


def add_seed(parser: argparse.ArgumentParser, default: int = 0) -> None:
    """Adds ``--seed``."""
    help_ = f"seed of all random draws (default {default})"
    parser.add_argument("--seed", type=int, default=default, metavar="N", help=help_)


def add_jobs(parser: argparse.ArgumentParser, default: int | None = None) -> None:
    """Adds ``--jobs``; by default one process per core."""
    shown = "one per core" if default is None else str(default)
    if default is None:
        import joblib  # imported here, so that commands without this option start faster

        default = joblib.cpu_count()
    parser.add_argument(
        "--jobs", type=int, default=default, metavar="N", help=f"parallel processes (default: {shown})"
    )


def add_out(parser: argparse.ArgumentParser, default: str = "results", holds: str = "folder for the results") -> None:
    """Adds ``--out``."""
    help_ = f"{holds} (default {default}/)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, default=Path(default), metavar="DIR", help=help_)


def add_models(parser: argparse.ArgumentParser, holds: str = "arm, materials and tools to use") -> None:
    """Adds ``--models``."""
    parser.add_argument("--models", type=Path, default=MODELS, metavar="DIR", help=f"folder with {holds}")


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Adds ``--robot``, with its former names ``--models`` and ``--arm``, and the options of a robot's file."""
    group = find_group(parser, ROBOT)
    help_ = "folder written by import-arm, or a robot's file, which is imported once (default: the paper's arm)"
    group.add_argument("--robot", type=Path, metavar="PATH", help=help_)
    for former in ("--models", "--arm"):
        group.add_argument(former, type=Path, dest="robot", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    add_arm_arguments(parser)


def read_robot(arguments: argparse.Namespace) -> tuple[Path | None, ImportOptions, Path]:
    """Returns the robot, its import options, and the folder for imports, ``arms`` in the results folder."""
    out: Path | None = getattr(arguments, "out", None)
    return arguments.robot, read_options(arguments), (out or Path("results")) / "arms"


def add_set(
    parser: argparse.ArgumentParser,
    what: str = "change a setting, for example prior.sd=8000; may be repeated; affordance settings lists all",
) -> None:
    """Adds ``--set``, which changes settings by name."""
    parser.add_argument("--set", action="append", default=[], dest="changes", metavar="NAME=VALUE", help=what)


def add_learner(parser: argparse.ArgumentParser) -> None:
    """Adds ``--learner``; see ``read_changes``."""
    default = DEFAULT_SETTINGS.learner.name
    what = f"{', '.join([*LEARNERS, *RIVALS])}, or your own as FILE.py:CLASS, whose code is run (default {default})"
    parser.add_argument("--learner", metavar="LEARNER", help=what)


def read_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Collects the changes of settings, by name, from ``--set`` and, if the command has it, ``--learner``.

    Raises:
        BadValueError: If a change is malformed or repeated, or the learner is unknown.
    """
    changes = parse_changes(arguments.changes)
    if word := getattr(arguments, "learner", None):
        if "learner" in changes:
            raise BadValueError("--set", "learner", "is given together with --learner, must be given once")
        changes["learner"] = load_learner(word)
    return changes


def add_prior_set(parser: argparse.ArgumentParser) -> None:
    """Adds ``--set`` for commands that use only the prior's settings; see ``read_prior``."""
    add_set(parser, "change a setting of the prior, for example prior.sd=8000; may be repeated")


def add_answer(parser: argparse.ArgumentParser, files: str) -> None:
    """Adds ``--json`` and ``--out``, a folder for the named files; see ``give_answer``."""
    add_json(parser)
    what = f"folder for {files} (default: no files)"
    find_group(parser, OUTPUT).add_argument("--out", type=Path, metavar="DIR", help=what)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Adds ``--json``; see ``print_answer``."""
    find_group(parser, OUTPUT).add_argument("--json", action="store_true", help="print the answer as JSON")


def tell(arguments: argparse.Namespace, remark: str) -> None:
    """Prints a remark that is not part of the answer: to standard error with ``--json``, never with ``--quiet``."""
    if not getattr(arguments, "quiet", False):
        print(remark, file=sys.stderr if getattr(arguments, "json", False) else sys.stdout, flush=True)


def print_answer(arguments: argparse.Namespace, text: str, content: Any) -> None:
    """Prints an answer as text, or with ``--json`` its content as JSON."""
    print(json.dumps(to_plain(content), indent=2) if arguments.json else text)


def give_answer(
    arguments: argparse.Namespace,
    name: str,
    text: str,
    content: Mapping[str, Any],
    draw: "Callable[[], Figure] | None" = None,
) -> None:
    """Prints an answer, and writes it as text, JSON and perhaps a figure to the folder of ``--out``."""
    text = show_text(text, PROSE)
    if arguments.out is not None:
        write_text(arguments.out / f"{name}.txt", text + "\n")
        write_json(arguments.out / f"{name}.json", content)
        if draw is not None:
            # Imported here, so that runs without --out start faster.
            from affordance.reporting.figures import save_figure

            save_figure(draw(), arguments.out, name)
    print_answer(arguments, text, content)


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
    """Adds the options of a command that simulates observers: repeats, seed, jobs, results, models and settings.

    If ``models`` is empty, the command takes a robot in place of a model folder.
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
    """Raises a BadValueError if a shared number is out of bounds, or the model folder does not exist."""
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
    refuse_changes(arguments, [name for name in groups if name != "prior"], f"{what} uses only the prior's settings")
    return change_by_name(arguments).prior


def refuse_changes(arguments: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Raises a BadValueError with the reason ``why`` if ``--set`` changes one of the settings or groups named."""
    for name in parse_changes(arguments.changes):
        if any(name == each or name.startswith(f"{each}.") for each in names):
            raise BadValueError("--set", name, f"has no effect here: {why}")


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


def choose_tools(tools: Sequence[Tool], names: Sequence[str], path: Path) -> list[Tool]:
    """Selects tools by name, or all of them if none is named.

    Raises:
        AffordanceError: If a name is unknown, or a selected tool has no grips.
    """
    known = {tool.name: tool for tool in tools}
    for name in names:
        if name not in known:
            raise BadValueError(path, "--only", describe_choice(name, list(known)))
    chosen = [known[name] for name in names] or list(tools)
    for tool in chosen:
        if not tool.grips:
            raise AffordanceError(f"{path}: {tool.name} has no grips, must have at least one")
    return chosen


def add_same_colours(parser: argparse.ArgumentParser) -> None:
    """Adds ``--same-colour``, for colours that two cameras see differently."""
    help_ = "treat two colours as one, as seen by two cameras, for example #b5a642=#c0b050; may be repeated"
    parser.add_argument("--same-colour", action="append", default=[], metavar="A=B", help=help_)


def read_same_colours(arguments: argparse.Namespace, at_hand: Mapping[str, Material]) -> SameColours:
    """Reads the pairs of colours of ``--same-colour``.

    If one colour of a pair is that of a material at hand, it is the first of the returned pair.

    Raises:
        BadValueError: If a word is not a colour, both colours are those of materials at hand, or pairs are given
            without ``--memory``.
    """
    pairs = []
    for word in arguments.same_colour:
        one, _, other = word.partition("=")
        if not (is_colour(one) and is_colour(other)):
            raise BadValueError("--same-colour", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
        pairs.append((parse_colour(one), parse_colour(other)))
    if pairs and not arguments.memory:
        raise BadValueError("--same-colour", "", "applies to remembered colours, must be given with --memory")
    return join_colours(pairs, {name: material.colour for name, material in at_hand.items()})
