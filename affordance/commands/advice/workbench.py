"""Loads tools, tasks and memory for the commands that choose tools."""

import argparse
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from affordance.arguments import check_number, check_whole
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.demand import Criterion
from affordance.choice.hammer import Hammer, keep_strikers
from affordance.choice.inner_simulation import Choice, Draws, TaskCostModel
from affordance.choice.listed_options import list_drawn_options
from affordance.choice.options import Option, add_weighings, merge_alike
from affordance.choice.pricing import GripBounds
from affordance.choice.ranking import Ranking, rank_draws
from affordance.choice.tasks import is_any_still, load_task_file
from affordance.commands import options
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.extensions.advice.easing import explain_failure
from affordance.extensions.advice.known_materials import NamedBelief, know_by_name
from affordance.extensions.memory.ledger import count_of, open_memory
from affordance.files.constraints import Whole
from affordance.files.lacks import read_lacks
from affordance.objects.load import select_known
from affordance.objects.materials import MATERIALS, Material, load_materials
from affordance.objects.tool import Tool
from affordance.reporting.formatting import break_line
from affordance.robot import Robot
from affordance.settings import Settings

# Value of ``--know`` for no material.
_NOTHING = "nothing"
# Names of tasks in the record of an import, if they differ from the names here.
_OF_IMPORT = {"hammer": "blow", "reach": "path"}
# Largest plausible force and moment of a gripper, [N] and [N m]. A larger value must be in the wrong unit.
_FORCE_MAX, _MOMENT_MAX = 1e5, 1e4


class Bench(NamedTuple):
    """Tools, tasks, belief and criterion for the choice of a tool.

    Every tool has at least one grip. The settings contain the robot's arm and the changes of ``--set``.
    """

    settings: Settings
    materials: Mapping[str, Material]
    tools: list[Tool]
    stock: list[Tool]  # other objects that may be held
    named: NamedBelief
    tasks: Mapping[str, TaskCostModel]
    criterion: Criterion
    remarks: tuple[str, ...] = ()  # warnings about the tools file and the arm


def check_choice(arguments: argparse.Namespace, fewest_samples: int) -> GripBounds:
    """Checks the options of a choice before the robot is opened, and returns the limits of the gripper."""
    options.check_bounds(arguments)
    options.refuse_changes(arguments, ["cost_measure"], "--by says what is compared")
    check_whole("--samples", arguments.samples, Whole(fewest_samples, 100_000))
    given = {}
    for name, largest, unit in (("force", _FORCE_MAX, "N"), ("moment", _MOMENT_MAX, "N m")):
        value = getattr(arguments, f"max_grip_{name}")
        if value is not None:
            given[name] = check_number(f"--max-grip-{name}", value, 1e-3, largest, unit)
    return GripBounds(**given)


def open_bench(arguments: argparse.Namespace, robot: Robot, names: Sequence[str], stock: Path | None = None) -> Bench:
    """Loads the tools, tasks and memory that the options name.

    Args:
        arguments: Parsed arguments.
        robot: Robot that will use the tool.
        names: Names of the robot's tasks.
        stock: File with further objects that may be held.
    """
    settings = options.change_by_name(arguments, Settings(arm=robot.directives))
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    known, remarks = options.read_tools(arguments.tools, materials)
    if arguments.see == "pictures" and options.is_object_file(arguments.tools):
        remarks += (f"{arguments.tools.name}: centre of mass and moments follow from what the pictures show",)
    tools = options.choose_tools(known, arguments.only, arguments.tools)
    others, of_stock = options.read_tools(stock, materials) if stock else ((), ())
    remarks = tuple(dict.fromkeys((*remarks, *of_stock)))  # without duplicates, because both files may be the same
    named = know_materials(arguments, settings, [*tools, *others], materials)
    tasks = read_tasks(names, arguments.files, robot)
    lacks = read_lacks(robot.folder)
    for name in names:
        why = lacks.get("objects") or lacks.get(_OF_IMPORT.get(name, name))
        if why:
            remarks += (f"the import found {name} infeasible for this arm: {why}",)
    criterion = _choose_criterion(arguments.by, robot, tasks.values())
    return Bench(settings, materials, tools, list(others), named, tasks, criterion, remarks)


def know_materials(
    arguments: argparse.Namespace, settings: Settings, tools: Sequence[Tool], materials: Mapping[str, Material]
) -> NamedBelief:
    """Adds the handbook densities of ``--know`` to the memory, which is empty without ``--memory``."""
    memory = MaterialMemory(settings.learner)
    if arguments.memory is not None:
        with open_memory(arguments.memory, create=False) as ledger:
            memory = ledger.recall(settings.learner, settings.prior)
    names: list[str] | None = None
    if arguments.know is not None:
        names = [] if arguments.know == _NOTHING else [each.strip() for each in arguments.know.split(",")]
    for name in names or ():
        if name not in materials:
            raise BadValueError("--know", "", describe_choice(name, [*materials, _NOTHING]))
    return know_by_name(memory, tools, materials, settings.prior, names)


def see_tools(arguments: argparse.Namespace, bench: Bench) -> list[Option]:
    """Lists the options (a tool in a grip), with shapes according to ``--see`` and with weighings."""
    if arguments.see == "drawing":
        seen = list_drawn_options(bench.tools)
    else:
        # Imported here, because it loads OpenCV.
        from affordance.extensions.pixels.seen_tool import list_seen_options

        seen = list_seen_options(bench.tools, arguments.seed)
    return merge_alike(add_weighings(seen, bench.tools))


def rank_tools(
    arguments: argparse.Namespace, bench: Bench, choice: Choice, task: TaskCostModel, bounds: GripBounds
) -> tuple[Ranking, Draws]:
    """Ranks the options for a task, using samples from the belief in the bench's memory.

    Raises:
        AffordanceError: No option is usable. The message explains why the nearest option is not.
    """
    settings, rng = bench.settings, np.random.default_rng(arguments.seed)
    colours = [material.colour for material in select_known(bench.materials, bench.tools).values()]
    memory = bench.named.memory.add_colours(list(dict.fromkeys(colours)), settings.prior)
    draws = choice.draw(memory, rng, arguments.samples)
    ranking = rank_draws(choice, draws, rng, criterion=bench.criterion, bounds=bounds)
    if not ranking.num_usable:
        raise AffordanceError(explain_failure(ranking, task, memory, settings, bounds, rng))
    return ranking, draws


def choose_strikers(
    options: Sequence[Option], task: TaskCostModel, tools: Sequence[Tool], path: Path
) -> tuple[list[Option], tuple[str, ...]]:
    """Selects the options that have a striking face, if the task is a blow.

    Raises:
        BadValueError: The task is a blow, and no tool has a striking face.

    Returns:
        The options, and remarks on soft faces and on tools without a face.
    """
    if not isinstance(task, Hammer):
        return list(options), ()
    if not any(part.strikes for option in options for part in option.features):
        problem = "has no tool with a striking face, must have strikes: {NAME: {point: [x, y, z], normal: [x, y, z]}}"
        raise BadValueError(path, "tools", problem)
    kept = keep_strikers(options)
    without = dict.fromkeys(option.object_name for option in options if option not in kept)
    remarks = [f"{name} has no striking face (strikes) and cannot be used for a blow" for name in without]
    for tool in tools:
        soft = [part.material.name for part in tool.components if part.strikes and "rubber" in part.material.name]
        remarks += [
            f"{tool.name} strikes with {name}; its blow is computed as that of a hard face" for name in soft[:1]
        ]
    return kept, tuple(remarks)


def read_tasks(names: Sequence[str], files: Sequence[Path], robot: Robot) -> dict[str, TaskCostModel]:
    """Loads tasks of the robot by name, and tasks from files.

    Raises:
        BadValueError: There is no task, or two tasks have the same name.
    """
    if not (names or files):
        raise BadValueError("task", "", f"is missing, must be one of {', '.join(robot.tasks)}, or a file with --task")
    tasks = {name: robot.load_task(name) for name in names}
    for file in files:
        if file.stem in tasks:
            problem = f"is {str(file)!r}, must not have the same name as another task, {file.stem}"
            raise BadValueError("--task", "", problem)
        tasks[file.stem] = load_task_file(file, robot.arm)
    return tasks


def _choose_criterion(named: str | None, robot: Robot, tasks: Collection[TaskCostModel]) -> Criterion:
    """Returns the named criterion, or by default work for the paper's arm and the wrench at the grip for others.

    If a task is to hold still, which takes no work, the default is the wrench at the grip.

    Raises:
        BadValueError: Work is named, but a task is to hold still.
    """
    holds_still = is_any_still(tasks)
    criterion = Criterion(named or (Criterion.WORK if robot.is_default and not holds_still else Criterion.GRIP))
    if holds_still and criterion is Criterion.WORK:
        others = ", ".join(each.value for each in Criterion if each is not Criterion.WORK)
        raise BadValueError("--by", "", f"is 'work', which is zero for holding still, must be one of {others}")
    return criterion


def tell_sources(arguments: argparse.Namespace, robot: Robot, named: NamedBelief) -> dict[str, Any]:
    """Lists the sources of the belief about materials, for the content of an answer."""
    return {
        "memory": Path(arguments.memory).name if arguments.memory else None,
        "trials_of_other_arms": count_of(robot, arguments.memory),
        **named.list_sources(),
    }


def break_lines(lines: Sequence[str], width: int) -> str:
    """Joins the lines of an answer, wrapped to a width. Empty lines are omitted."""
    return "\n".join(part for line in lines if line for part in break_line(line, width))
