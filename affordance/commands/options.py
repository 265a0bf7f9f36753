"""Options shared by commands, declared and checked in one place."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from affordance.arguments import JOBS, REPEATS, check_whole
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.files.constraints import SEEDS
from affordance.files.model_folder import MODELS
from affordance.memory.evidence_sums import SameColours
from affordance.named_settings import change_settings, list_settings, parse_changes
from affordance.objects.colour import COLOUR_FORM, Colour, is_colour, parse_colour
from affordance.objects.tool import Tool
from affordance.robots.frozen import parse_values
from affordance.robots.importer import AXES, ImportOptions, parse_spread
from affordance.settings import DEFAULT_SETTINGS, Settings

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


def find_shipped(arguments: argparse.Namespace) -> Path:
    """Returns the folder whose protocols can be named: that of the robot, or of the program for a robot's file."""
    robot: Path | None = arguments.robot
    return robot if robot is not None and robot.is_dir() else MODELS


def check_experiment(arguments: argparse.Namespace, names: Sequence[str]) -> None:
    """Raises a BadValueError for no such experiment, protocol of the models, or path of a protocol."""
    # Imported here, as commands without an experiment need not wait for it.
    from affordance.protocols.protocol import SUFFIXES, list_shipped

    if Path(arguments.experiment).suffix not in SUFFIXES:
        known = dict.fromkeys((*names, *list_shipped(find_shipped(arguments))))
        if arguments.experiment not in known:
            raise BadValueError("experiment", "", describe_choice(arguments.experiment, known))


def add_set(parser: argparse.ArgumentParser) -> None:
    """Adds ``--set``, which changes settings by name."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="NAME=VALUE",
        help="a setting, as prior.sd=8000; more than once; affordance settings lists all",
    )


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
    """Applies the changes of ``--set`` to settings; an unknown one, or a wrong value, is a BadValueError."""
    return change_settings(settings, parse_changes(arguments.changes))


def list_groups(except_for: str) -> list[str]:
    """Lists the names of all groups of settings and of settings without group, except one."""
    names = dict.fromkeys(each.name.partition(".")[0] for each in list_settings())
    return [name for name in names if name != except_for]


def refuse_changes(arguments: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Raises a BadValueError, with a reason, for a changed setting, or group, that a command does not use."""
    for name in parse_changes(arguments.changes):
        if any(name == each or name.startswith(f"{each}.") for each in names):
            raise BadValueError("--set", name, f"changes nothing here: {why}")


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
    """Builds options from the arguments that ``add_arm_arguments`` adds; an invalid one is a BadValueError."""
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


def add_choice(parser: argparse.ArgumentParser, files: str) -> None:
    """Adds the options of a choice of tools: tools, memory, robot, seed, settings, and the name of written files."""
    add = parser.add_argument
    tools = MODELS / "workshop" / "tools.yaml"
    add("--tools", type=Path, default=tools, metavar="FILE", help="tools with grips (default: ours)")
    add("--only", action="append", default=[], metavar="NAME", help="tools of it; more than once")
    add("--meshes", type=Path, metavar="DIR", help="folder of the mesh files (default: folder of the tools file)")
    add("--materials", type=Path, metavar="FILE", help="materials (default: the robot's)")
    add("--memory", metavar="MEMORY", help="lasting memory of materials: SQLite file or URL (default: none)")
    # For what two cameras see differently.
    same = "colours of a memory that are to count as one, as #b5a642=#c0b050; more than once"
    add("--same-colour", action="append", default=[], metavar="A=B", help=same)
    add("--json", action="store_true", help="print the result as JSON")
    add("--out", type=Path, metavar="DIR", help=f"folder for {files}.json, .txt, .png and .svg (default: none)")
    add_robot(parser)
    add_seed(parser)
    add_set(parser)


def parse_same_colours(words: Sequence[str]) -> list[tuple[Colour, Colour]]:
    """Parses pairs of colours, as '#b5a642=#c0b050'; anything else raises a BadValueError."""
    pairs = []
    for word in words:
        one, _, other = word.partition("=")
        if not (is_colour(one) and is_colour(other)):
            raise BadValueError("--same-colour", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
        pairs.append((parse_colour(one), parse_colour(other)))
    return pairs


def recall(place: str | None, settings: Settings, same_colours: SameColours) -> Memory:
    """Recalls a lasting memory, or without one that of an observer who knows nothing."""
    if place is None:
        return MaterialMemory()
    from affordance.memory.ledger import open_memory  # here, as SQLAlchemy takes a third of a second

    with open_memory(place, create=False) as ledger:
        return ledger.recall(settings.learner, settings.prior, same_colours=same_colours)


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
