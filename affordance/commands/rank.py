"""``affordance rank``: ranks tools and the ends to hold them by, for a task, and says why."""

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from affordance.arguments import check_number
from affordance.belief.colour_recognition import find_colour_index
from affordance.choice.demand import Criterion
from affordance.choice.easing import explain_failure
from affordance.choice.inner_simulation import TaskCostModel
from affordance.choice.keep import Keep
from affordance.choice.pricing import GripBounds, plan_options
from affordance.choice.ranking import rank_draws
from affordance.choice.reasons import explain_choice
from affordance.choice.tasks import load_task_file
from affordance.commands.demo import TRIALS, announce, check_alone
from affordance.commands.options import give_answer, read_options, refuse_changes
from affordance.commands.workbench import add_choice, check_choice, choose_criterion, open_bench, see_tools
from affordance.exceptions import AffordanceError, BadValueError
from affordance.memory.exchange import read_trials
from affordance.memory.ledger import open_memory
from affordance.objects.load import select_known
from affordance.reporting.advice_report import AdviceQuestion, build_content, describe_advice, name_materials
from affordance.robots.kept import open_robot
from affordance.robots.robot import Robot
from affordance.settings import Settings
from affordance.simulation.trial_record import recognise_arm

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Bounds of what a gripper may hold, [N] and [N m]: values beyond are mistakes in units.
_FORCE_MAX, _MOMENT_MAX = 1e5, 1e4
# Name of the written files.
_NAME = "ranking"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.epilog = "rank compares tools for one task; affordance next takes several"
    add = parser.add_argument
    add("task", nargs="?", help="task of the robot: hammer, reach, mash, carry or hold")
    add("--task", dest="file", type=Path, metavar="FILE", help="a task's file in place of one of the robot's")
    add("--max-grip-force", type=float, metavar="N", help="force that the gripper holds, [N] (default: any)")
    add("--max-grip-moment", type=float, metavar="NM", help="moment that the gripper holds, [N m] (default: any)")
    add("--demo", action="store_true", help="rank our hammers by what simulated recordings of the package taught")
    add_choice(parser, _NAME, samples=10_000)


def run(arguments: argparse.Namespace) -> int:
    """Ranks the options, prints the ranking, and writes it with a picture if there is a folder for it."""
    if arguments.demo:
        return _run_demo(arguments)
    check_choice(arguments, 1)
    refuse_changes(arguments, ["cost_measure"], "--by says what is compared")
    bounds = read_grip_bounds(arguments)
    robot = open_robot(arguments.robot, read_options(arguments), (arguments.out or Path("results")) / "arms")
    bench = open_bench(arguments, robot)
    _, settings, materials, tools, known, _ = bench
    name, task = read_task(arguments, robot)
    criterion = _choose_criterion(arguments.by, robot, task)
    colours = [material.colour for material in select_known(materials, tools).values()]
    memory = known.add_colours(list(dict.fromkeys(colours)), settings.prior)
    choice = plan_options(see_tools(arguments, bench), task, settings)
    rng = np.random.default_rng(arguments.seed)
    draws = choice.draw(memory, rng, arguments.samples)
    ranking = rank_draws(choice, draws, rng, criterion=criterion, bounds=bounds)
    if not ranking.num_usable:
        raise AffordanceError(explain_failure(ranking, task, memory, settings, bounds, rng))
    parts = [part.looks_like for tool in tools for part in tool.components]
    question = AdviceQuestion(
        name,
        robot.name,
        arguments.see,
        Path(arguments.memory).name if arguments.memory else "",
        tuple(dict.fromkeys(each.name for each in parts if find_colour_index(known.colours, each.colour) is None)),
        name_materials(tools, materials),
        _count_other_arms(arguments.memory, robot),
        explain_choice(ranking, draws, choice.options),
    )
    text, content = describe_advice(ranking, question), build_content(ranking, question)

    def draw() -> "Figure":
        # Imported here: they take most of a second, which runs without --out need not wait.
        from affordance.reporting.advice_figure import draw_advice, render_choice

        picture = render_choice(settings.arm, ranking, {tool.name: tool for tool in tools})
        return draw_advice(ranking, content["sentence"], picture)

    give_answer(arguments, _NAME, text, content, draw)
    return 0


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


def _choose_criterion(named: str | None, robot: Robot, task: TaskCostModel) -> Criterion:
    """Chooses what is compared; holding still, which takes no work, is compared by the wrench at the grip."""
    if not isinstance(task, Keep):
        return choose_criterion(named, robot)
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
