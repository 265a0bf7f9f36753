"""``affordance rank``: ranks tools and the ends to hold them by, for a task, and says why."""

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from affordance.belief.colour_recognition import find_colour_index
from affordance.choice.expected_inertia import expect
from affordance.choice.pricing import plan_options
from affordance.choice.reasons import explain_choice
from affordance.commands.demo import TRIALS, announce, check_alone
from affordance.commands.options import give_answer, read_robot
from affordance.commands.workbench import add_choice, check_choice, open_bench, rank_tools, see_tools
from affordance.exceptions import BadValueError
from affordance.memory.exchange import read_trials
from affordance.memory.ledger import open_memory
from affordance.reporting.advice_report import AdviceQuestion, build_content, describe_advice, name_materials
from affordance.reporting.expectation_text import build_expectations, describe_expectations
from affordance.robots.kept import open_robot
from affordance.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Name of the written files.
_NAME = "ranking"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.epilog = "rank compares tools for one task; affordance next takes several"
    add = parser.add_argument
    add("task", nargs="?", help="task of the robot: hammer, reach, mash, carry or hold")
    add("--demo", action="store_true", help="rank our hammers by what simulated recordings of the package taught")
    add_choice(parser, _NAME, samples=10_000)


def run(arguments: argparse.Namespace) -> int:
    """Ranks the options, prints the ranking, and writes it with a picture if there is a folder for it."""
    if arguments.demo:
        return _run_demo(arguments)
    names = [arguments.task] if arguments.task else []
    if (given := len(names) + len(arguments.files)) > 1:
        raise BadValueError("task", "", f"is given {given} times, must be given once; affordance next takes several")
    bounds = check_choice(arguments, 1)
    robot = open_robot(*read_robot(arguments))
    bench = open_bench(arguments, robot, names)
    settings, materials, tools, known, _, tasks, _ = bench
    ((name, task),) = tasks.items()
    choice = plan_options(see_tools(arguments, bench), task, settings)
    ranking, draws = rank_tools(arguments, bench, choice, task, bounds)
    parts = [part.looks_like for tool in tools for part in tool.components]
    seen = {option.object_name: option.features for option in choice.options}
    expected = [expect(tool, known, settings, seen[tool.name]) for tool in tools]
    question = AdviceQuestion(
        name,
        robot.name,
        arguments.see,
        Path(arguments.memory).name if arguments.memory else "",
        tuple(dict.fromkeys(each.name for each in parts if find_colour_index(known.colours, each.colour) is None)),
        name_materials(tools, materials),
        robot.count_past_arms(arguments.memory),
        robot.describe_tilt(),
        explain_choice(ranking, draws, choice.options),
    )
    *lines, sentence = describe_advice(ranking, question).splitlines()
    text = "\n".join([*lines, *describe_expectations(expected), sentence])
    content = {**build_content(ranking, question), "expected": build_expectations(expected)}

    def draw() -> "Figure":
        # Imported here: they take most of a second, which runs without --out need not wait.
        from affordance.reporting.advice_figure import draw_advice, render_choice

        picture = render_choice(settings.arm, ranking, {tool.name: tool for tool in tools})
        return draw_advice(ranking, content["sentence"], picture)

    give_answer(arguments, _NAME, text, content, draw)
    return 0


def _run_demo(arguments: argparse.Namespace) -> int:
    """Ranks our hammers by a memory of the trials that come with the package."""
    check_alone(arguments, {"task": "a task", "files": "--task", "memory": "--memory"})
    teach = ["memory", "import", "demo.sqlite", TRIALS]
    announce(teach, ["rank", "hammer", "--memory", "demo.sqlite"], quietly=arguments.json)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "demo.sqlite"
        with open_memory(place) as ledger:
            ledger.append(read_trials(TRIALS, Settings().prior))
        arguments.demo, arguments.task, arguments.memory = False, "hammer", str(place)
        return run(arguments)
