"""Options that describe a trial table, its objects and columns, and the reader of the table."""

import argparse
from pathlib import Path

from affordance.choice.inner_simulation import TaskCostModel
from affordance.commands.people.columns import add_columns, read_columns
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.trials import COLUMNS, TrialTable, read_trials
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.robot import Robot

# File name suffixes of trial tables.
SUFFIXES = (".csv", ".tsv", ".txt")


def add_table_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that describe a table of trials."""
    add = parser.add_argument
    add("--objects", type=Path, metavar="FILE", help="tools file with the objects named in the table of trials")
    add_columns(parser, COLUMNS)
    add("--materials", type=Path, metavar="FILE", help="materials of the objects (default: the robot's)")
    add("--meshes", type=Path, metavar="DIR", help="folder of mesh files (default: that of the objects file)")


def open_table(
    arguments: argparse.Namespace, path: Path, robot: Robot
) -> tuple[TrialTable, dict[str, TaskCostModel]]:
    """Reads a table, its objects, and the tasks that it names; an error in any of them raises a BadValueError."""
    if arguments.objects is None:
        raise BadValueError("--objects", "", f"is missing, must be a tools file with the objects of {path.name}")
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = load_tools(arguments.objects, materials, arguments.meshes)
    table = read_trials(path, tools, materials, columns=read_columns(arguments), tasks=robot.tasks)
    return table, {each: robot.load_task(each) for each in dict.fromkeys(table.rows["task"]) if each}
