"""``affordance rank``: ranks tools and the ends to hold them by, for a task, and says why."""

import argparse
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from affordance.arguments import check_number, check_whole
from affordance.belief.colour_recognition import find_colour_index
from affordance.choice.demand import Criterion
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.keep import Keep
from affordance.choice.observed_options import list_options
from affordance.choice.options import Option
from affordance.choice.pricing import GripBounds
from affordance.choice.tasks import load_task_file
from affordance.choice.tool_options import list_tool_options
from affordance.choice.weighing import Advice, weigh
from affordance.commands.demo import TRIALS, announce, check_alone
from affordance.commands.options import (
    add_choice,
    change_by_name,
    check_bounds,
    choose_tools,
    parse_same_colours,
    read_options,
    recall,
    refuse_changes,
)
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_json, write_text
from affordance.files.constraints import Whole
from affordance.memory.exchange import read_trials
from affordance.memory.ledger import open_memory
from affordance.objects.load import load_tools, select_known
from affordance.objects.materials import MATERIALS, load_materials
from affordance.objects.tool import Tool
from affordance.reporting.advice_report import AdviceQuestion, build_content, describe_advice, name_materials
from affordance.robots.kept import open_robot
from affordance.robots.robot import Robot
from affordance.settings import Settings
from affordance.simulation.trial_record import recognise_arm

_SAMPLES = Whole(1, 1_000_000)
# Bounds of what a gripper may hold, [N] and [N m]: values beyond are mistakes in units.
_FORCE_MAX, _MOMENT_MAX = 1e5, 1e4
# Name of the written files.
_NAME = "ranking"
# Ways in which the form of tools is known.
_SIGHTS = ("drawing", "features", "pictures")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.epilog = "rank compares tools for one task; affordance next takes several"
    add = parser.add_argument
    add("task", nargs="?", help="task of the robot: hammer, reach, mash, carry or hold")
    add("--task", dest="file", type=Path, metavar="FILE", help="a task's file in place of one of the robot's")
    add(
        "--see",
        choices=_SIGHTS,
        default=_SIGHTS[0],
        help="how form is known: features are sizes with errors (vision_error)",
    )
    add(
        "--by",
        choices=[each.value for each in Criterion],
        help="what is compared: expected work, effort, highest share of a torque limit, or wrench at the grip "
        "(default: work for the paper's arm, grip for any other)",
    )
    add("--max-grip-force", type=float, metavar="N", help="force that the gripper holds, [N] (default: any)")
    add("--max-grip-moment", type=float, metavar="NM", help="moment that the gripper holds, [N m] (default: any)")
    add("--samples", type=int, default=10_000, metavar="N", help="samples of the belief (default: 10000)")
    add("--demo", action="store_true", help="rank our hammers by what simulated recordings of the package taught")
    add_choice(parser, _NAME)


def run(arguments: argparse.Namespace) -> int:
    """Ranks the options, prints the ranking, and writes it with a picture if there is a folder for it."""
    if arguments.demo:
        return _run_demo(arguments)
    check_bounds(arguments)
    check_whole("--samples", arguments.samples, _SAMPLES)
    refuse_changes(arguments, ["cost_measure"], "--by says what is compared")
    bounds = read_grip_bounds(arguments)
    robot = open_robot(arguments.robot, read_options(arguments), (arguments.out or Path("results")) / "arms")
    settings = change_by_name(arguments, Settings(arm=robot.directives))
    name, task = read_task(arguments, robot)
    criterion = choose_criterion(arguments.by, robot, task)
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = choose_tools(load_tools(arguments.tools, materials, arguments.meshes), arguments.only, arguments.tools)
    known = recall(arguments.memory, settings, parse_same_colours(arguments.same_colour))
    colours = [material.colour for material in select_known(materials, tools).values()]
    advice = weigh(
        _see(arguments, tools, settings),
        task,
        known.add_colours(list(dict.fromkeys(colours)), settings.prior),
        settings,
        criterion=criterion,
        bounds=bounds,
        num_samples=arguments.samples,
        rng=np.random.default_rng(arguments.seed),
    )
    parts = [part.looks_like for tool in tools for part in tool.components]
    question = AdviceQuestion(
        name,
        robot.name,
        arguments.see,
        Path(arguments.memory).name if arguments.memory else "",
        tuple(dict.fromkeys(each.name for each in parts if find_colour_index(known.colours, each.colour) is None)),
        name_materials(tools, materials),
        _count_other_arms(arguments.memory, robot),
    )
    text, content = describe_advice(advice, question), build_content(advice, question)
    if arguments.out is not None:
        write_text(arguments.out / f"{_NAME}.txt", text + "\n")
        write_json(arguments.out / f"{_NAME}.json", content)
        _draw(arguments.out, advice, settings, tools, content["sentence"])
    print(json.dumps(content, indent=2) if arguments.json else text)
    return 0


def _see(arguments: argparse.Namespace, tools: Sequence[Tool], settings: Settings) -> list[Option]:
    if arguments.see == "features":
        return [each for tool in tools for each in list_options(tool, settings.vision_error, arguments.seed)]
    return list_tool_options(tools, by_sight=arguments.see == "pictures", seed=arguments.seed)


def _count_other_arms(place: str | None, robot: Robot) -> int:
    """Counts the trials of a memory that the robot made with another arm than it has now."""
    if place is None:
        return 0
    name = robot.name.removeprefix("the ")
    with open_memory(place, create=False) as ledger:
        if not ledger.count_of_other_arms(name):
            return 0
        # An arm is loaded only for the robot's own trials: simulated ones know its files, recorded ones its chain.
        return ledger.count_of_other_arms(name, recognise_arm(robot.directives), robot.chain.fingerprint)


def _run_demo(arguments: argparse.Namespace) -> int:
    """Ranks our hammers by a memory of the trials that come with the package."""
    check_alone(arguments, {"task": "a task", "file": "--task", "memory": "--memory"})
    announce(
        ["memory", "import", "demo.sqlite", TRIALS],
        ["rank", "hammer", "--memory", "demo.sqlite"],
        quietly=arguments.json,
    )
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "demo.sqlite"
        with open_memory(place) as ledger:
            ledger.append(read_trials(TRIALS, Settings().prior))
        arguments.demo, arguments.task, arguments.memory = False, "hammer", str(place)
        return run(arguments)


def read_task(arguments: argparse.Namespace, robot: Robot) -> tuple[str, TaskCostModel]:
    """Reads the task, one of the robot's or that of a file, and its name; none or both is a BadValueError."""
    if (arguments.task is None) == (arguments.file is None):
        problem = f"must be one of {', '.join(robot.tasks)}, or --task a file"
        raise BadValueError("task", "", f"is {'missing' if arguments.file is None else 'given twice'}, {problem}")
    if arguments.file is not None:
        return arguments.file.stem, load_task_file(arguments.file)
    return arguments.task, robot.load_task(arguments.task)


def choose_criterion(named: str | None, robot: Robot, task: TaskCostModel) -> Criterion:
    """Chooses what is compared: as named, else work on the paper's arm and the wrench at the grip on others."""
    if not isinstance(task, Keep):
        return Criterion(named or (Criterion.WORK if robot.is_default else Criterion.GRIP))
    criterion = Criterion(named or Criterion.GRIP)
    if criterion is Criterion.WORK:
        others = ", ".join(each.value for each in Criterion if each is not Criterion.WORK)
        raise BadValueError("--by", "", f"is 'work', which is zero for holding still, must be one of {others}")
    return criterion


def read_grip_bounds(arguments: argparse.Namespace) -> GripBounds:
    """Reads what the gripper holds."""
    given = {}
    for name, largest, unit in (("force", _FORCE_MAX, "N"), ("moment", _MOMENT_MAX, "N m")):
        value = getattr(arguments, f"max_grip_{name}")
        if value is not None:
            given[name] = check_number(f"--max-grip-{name}", value, 1e-3, largest, unit)
    return GripBounds(**given)


def _draw(folder: Path, advice: Advice, settings: Settings, tools: Sequence[Tool], title: str) -> None:
    # Imported here: they take most of a second, which runs without --out need not wait.
    from affordance.reporting.advice_figure import draw_advice, render_choice
    from affordance.reporting.figures import save_figure

    picture = render_choice(settings.arm, advice, {tool.name: tool for tool in tools})
    save_figure(draw_advice(advice, title, picture), folder, _NAME)
