"""Workbench of the commands that choose tools: their options, and the robot, tools and memory that these name."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from affordance.arguments import check_whole
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.choice.demand import Criterion
from affordance.choice.listed_options import list_drawn_options, list_options, list_seen_options
from affordance.choice.options import Option
from affordance.commands.options import (
    add_answer,
    add_robot,
    add_seed,
    add_set,
    change_by_name,
    check_bounds,
)
from affordance.commands.same_colours import add_same_colours, read_same_colours
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.files.constraints import Whole
from affordance.files.model_folder import MODELS
from affordance.memory.same_colours import SameColours
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool
from affordance.robots.robot import Robot
from affordance.settings import Settings

# Ways in which the form of tools is known.
SIGHTS = ("drawing", "features", "pictures")


class Bench(NamedTuple):
    """What the options of a choice name: a robot with its settings, materials, tools, and a memory of materials.

    Attributes:
        same_colours: Pairs of colours, of which the memory's second is read as the first.
    """

    robot: Robot
    settings: Settings
    materials: Mapping[str, Material]
    tools: list[Tool]
    memory: Memory
    same_colours: SameColours


def add_choice(parser: argparse.ArgumentParser, files: str, *, samples: int, sights: Sequence[str] = SIGHTS) -> None:
    """Adds the options of a choice of tools: what they are, how they are known and compared, and for which robot."""
    add = parser.add_argument
    add(
        "--see",
        choices=sights,
        default=sights[0],
        help="how the tools' form is known; features are sizes with errors (vision_error)",
    )
    add(
        "--by",
        choices=[each.value for each in Criterion],
        help="what is compared: expected work, effort, highest share of a torque limit, or wrench at the grip "
        "(default: work for the paper's arm, grip for any other)",
    )
    add("--samples", type=int, default=samples, metavar="N", help=f"samples of the belief (default {samples})")
    tools = MODELS / "workshop" / "tools.yaml"
    add("--tools", type=Path, default=tools, metavar="FILE", help="tools with grips (default: ours)")
    add("--only", action="append", default=[], metavar="NAME", help="tools of it; more than once")
    add("--meshes", type=Path, metavar="DIR", help="folder of the mesh files (default: folder of the tools file)")
    add("--materials", type=Path, metavar="FILE", help="materials (default: the robot's)")
    add("--memory", metavar="MEMORY", help="lasting memory of materials: SQLite file or URL (default: none)")
    add_same_colours(parser)
    add_answer(parser, f"{files}.json, .txt, .png and .svg")
    add_robot(parser)
    add_seed(parser)
    add_set(parser)


def check_choice(arguments: argparse.Namespace, fewest_samples: int) -> None:
    """Checks the numbers that the options of a choice have in common."""
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, Whole(fewest_samples, 1_000_000))


def open_bench(arguments: argparse.Namespace, robot: Robot) -> Bench:
    """Loads what the options of a choice name for a robot, with ``--set`` applied to the settings of its arm."""
    settings = change_by_name(arguments, Settings(arm=robot.directives))
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = choose_tools(load_tools(arguments.tools, materials, arguments.meshes), arguments.only, arguments.tools)
    same_colours = read_same_colours(arguments, materials)
    memory = recall(arguments.memory, settings, same_colours)
    return Bench(robot, settings, materials, tools, memory, same_colours)


def see_tools(arguments: argparse.Namespace, bench: Bench) -> list[Option]:
    """Lists the options that the tools offer, by drawings, features or pictures as ``--see`` says."""
    if arguments.see == "features":
        error, seed = bench.settings.vision_error, arguments.seed
        return [option for tool in bench.tools for option in list_options(tool, error, seed)]
    return (
        list_seen_options(bench.tools, arguments.seed)
        if arguments.see == "pictures"
        else list_drawn_options(bench.tools)
    )


def choose_criterion(named: str | None, robot: Robot) -> Criterion:
    """Chooses what is compared: as named, else work on the paper's arm and the wrench at the grip on others."""
    return Criterion(named or (Criterion.WORK if robot.is_default else Criterion.GRIP))


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
