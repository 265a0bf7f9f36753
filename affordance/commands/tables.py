"""Trial tables of the command line: the options that name table and objects, and the experiment that they make."""

import argparse
from pathlib import Path

from affordance.arguments import check_number
from affordance.belief.learner import Learner
from affordance.commands.setups import check_own_name
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.table_results import TableExperiment
from affordance.experiments.trials import COLUMNS, read_trials
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.robots.robot import Robot

# Suffixes of tables.
SUFFIXES = (".csv", ".tsv", ".txt")


def add_table_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that say what a table of trials is about."""
    add = parser.add_argument
    add("--objects", type=Path, metavar="FILE", help="tools file with the objects that a table of trials names")
    what = "names of columns in the table, as object=stim participant=subj; ours are " + ", ".join(COLUMNS)
    add("--columns", nargs="+", default=[], metavar="OURS=THEIRS", help=what)
    add("--materials", type=Path, metavar="FILE", help="materials of the objects (default: the robot's)")
    add("--meshes", type=Path, metavar="DIR", help="folder of the mesh files (default: folder of the objects' file)")


def open_table(
    arguments: argparse.Namespace, path: Path, robot: Robot, learners: tuple[Learner, ...] = tuple(Learner)
) -> TableExperiment:
    """Reads a table and its objects, and returns the experiment that they make.

    Something wrong in a file or an option raises a BadValueError; more repeats than can be computed too.
    """
    name = check_own_name(path)
    if arguments.objects is None:
        raise BadValueError("--objects", "", f"is missing, must be a tools file with the objects of {path.name}")
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = load_tools(arguments.objects, materials, arguments.meshes)
    columns = dict(map(_split, arguments.columns))
    table = read_trials(path, tools, materials, columns=columns, tasks=robot.tasks)
    tasks = {each: robot.load_task(each) for each in dict.fromkeys(table.rows["task"]) if each}
    sd = getattr(arguments, "people_sd", None)
    return TableExperiment(
        name,
        table,
        tasks=tasks,
        repeats=arguments.repeats or 1,
        learners=learners,
        people_sd=None if sd is None else check_number("--people-sd", sd, 1e-6, 1e3, "N"),
    )


def _split(word: str) -> tuple[str, str]:
    ours, _, theirs = word.partition("=")
    if not (ours and theirs):
        raise BadValueError("--columns", "", f"is {word!r}, must be OURS=THEIRS, such as object=stim")
    if ours not in COLUMNS:
        raise BadValueError("--columns", "", describe_choice(ours, COLUMNS))
    return ours, theirs
