"""Options of the commands for people's lifts: trial table, objects and fitted parameters."""

import argparse
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

from affordance.belief.learner import Learner
from affordance.choice.inner_simulation import TaskCostModel
from affordance.commands.options import check_bounds, refuse_changes
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments.planned_contrasts import PlannedContrast, parse_contrast
from affordance.extensions.people.experiments.trials import TrialTable, read_trials
from affordance.extensions.people.fit import Question
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import LiftSettings, with_participant
from affordance.extensions.people.pushes import Lifts, read_lifts
from affordance.extensions.people.static_lifts import check_closed_form
from affordance.named_settings import change_settings, parse_changes
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool
from affordance.robot import Robot
from affordance.runs.repeats import check_folder, prepare_folder
from affordance.settings import Settings


def read_columns(arguments: argparse.Namespace) -> dict[str, str]:
    """Reads the names of columns in the user's table. The keys are this program's names."""
    return dict(map(_split, arguments.columns))


def _split(word: str) -> tuple[str, str]:
    ours, _, theirs = word.partition("=")
    if not (ours and theirs):
        raise BadValueError("--columns", "", f"is {word!r}, must be OURS=THEIRS, for example object=stim")
    return ours, theirs


# File name suffixes of trial tables.
SUFFIXES = (".csv", ".tsv", ".txt")


def open_table(
    arguments: argparse.Namespace, path: Path, robot: Robot
) -> tuple[TrialTable, dict[str, TaskCostModel]]:
    """Reads a trial table with its objects and tasks.

    Raises:
        BadValueError: The table, its objects or its tasks are invalid.
    """
    tools, materials = open_objects(arguments, path, robot)
    table = read_trials(path, tools, materials, columns=read_columns(arguments), tasks=robot.tasks)
    return table, {each: robot.load_task(each) for each in dict.fromkeys(table.rows["task"]) if each}


def open_objects(
    arguments: argparse.Namespace, path: Path, robot: Robot
) -> tuple[Sequence[Tool], Mapping[str, Material]]:
    """Reads the objects of the table at ``path``, and the materials that they can have."""
    if arguments.objects is None:
        raise BadValueError("--objects", "", f"is missing, must be a tools file with the objects of {path.name}")
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    return load_tools(arguments.objects, materials, arguments.meshes), materials


def read_contrasts(arguments: argparse.Namespace, table: TrialTable) -> tuple[PlannedContrast, ...]:
    """Reads the planned contrasts of ``--contrast``."""
    return tuple(parse_contrast(each, table.rows) for each in dict.fromkeys(arguments.contrast))


# Folder inside ``--out`` with the fits of single people.
KEPT = "fitted_people"
# Default number of draws of the free parameters, for single people and for groups. With too few draws, the intervals
# of groups are too narrow.
DRAWS = (64, 256)


def read_setting(arguments: argparse.Namespace) -> tuple[Settings, Lifts]:
    """Reads settings and lifts from the options."""
    check_bounds(arguments)
    check_folder(arguments.out)
    refuse_changes(arguments, ["learner"], "--learner selects the learner, and --free its fitted parameters")
    spreads = ["participant.gain_spread", "participant.kappa_spread"]
    refuse_changes(arguments, spreads, "fits are of single people, or of one value for all")
    refuse_changes(arguments, ["point_estimate"], "fits use the most probable densities")
    if arguments.draws is None:
        arguments.draws = DRAWS[bool(getattr(arguments, "group", ""))]
    for option, value, least in (("--draws", arguments.draws, 4), ("--particles", arguments.particles, 1)):
        if not least <= value <= 10_000:
            nearest = min(max(value, least), 10_000)
            raise BadValueError(option, "", f"is {value}, must be from {least} to 10000; the nearest is {nearest}")
    settings = change_settings(LiftSettings(), parse_changes(arguments.changes))
    check_closed_form(settings)
    tools: tuple[Tool, ...] = ()
    materials = load_materials(MATERIALS)
    if arguments.objects is not None:
        tools = tuple(load_tools(arguments.objects, materials))
    lifts = read_lifts(
        arguments.lifts,
        learner=arguments.of,
        tools=tools,
        materials=materials,
        columns=read_columns(arguments),
        group=getattr(arguments, "group", ""),
    )
    return settings, lifts


def prepare_new_folder(path: Path) -> Path:
    """Creates a folder with the given name. If it exists, _2, _3 and so on is added to the name."""
    others = (path.with_name(f"{path.name}_{number}") for number in itertools.count(2))
    return prepare_folder(next(each for each in itertools.chain([path], others) if not each.exists()))


def ask(
    arguments: argparse.Namespace, settings: Settings, lifts: Lifts, learner: Learner, free: Sequence[str] | None
) -> Question:
    """Builds the fitting problem of one learner from the options."""
    return Question(
        lifts,
        learner,
        settings,
        list_free(learner, with_participant(settings).participant, free),
        arguments.draws,
        arguments.particles,
        seed=arguments.seed,
        jobs=arguments.jobs,
    )
