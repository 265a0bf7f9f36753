"""``affordance rank``: ranks tools and grips for a task, and explains the ranking."""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from affordance.arguments import check_number
from affordance.choice.pricing import plan_options
from affordance.choice.ranking import explain_choice
from affordance.commands.advice.workbench import (
    break_lines,
    check_choice,
    choose_strikers,
    open_bench,
    rank_tools,
    read_tasks,
    see_tools,
    tell_sources,
)
from affordance.commands.answers import give_answer
from affordance.commands.demo import TRIALS, announce, check_alone
from affordance.commands.options import change_by_name, open_robot
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.extensions.advice.advice_text import build_content, describe_advice, name_materials
from affordance.extensions.advice.expected_inertia import build_expectations, describe_expectations, expect
from affordance.extensions.advice.payload import measure_payload
from affordance.extensions.memory.ledger import import_trials, open_memory
from affordance.files.atomic import to_plain
from affordance.reporting.formatting import format_number, tabulate
from affordance.robot import Robot
from affordance.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Bounds of a payload, [kg] and [m] (a larger value must be in the wrong unit); exit status if it is too heavy.
_PAYLOAD_MAX, _DISTANCE_MAX, _TOO_HEAVY = 1e4, 10.0, 3
# Name of the written files.
_NAME = "ranking"


def run(arguments: argparse.Namespace) -> int:
    """Ranks the options, prints the ranking, and writes it with a picture to the folder of ``--out``."""
    if arguments.demo:
        return _run_demo(arguments)
    names = [arguments.task] if arguments.task else []
    if (given := len(names) + len(arguments.files)) > 1:
        raise BadValueError("task", "", f"is given {given} times, must be given once; affordance next takes several")
    bounds = check_choice(arguments, 1)
    robot = open_robot(arguments)
    if arguments.payload is not None:
        return _answer_payload(arguments, robot, names)
    bench = open_bench(arguments, robot, names)
    settings, materials, tools = bench.settings, bench.materials, bench.tools
    ((name, task),) = bench.tasks.items()
    options, remarks = choose_strikers(see_tools(arguments, bench), task, tools, arguments.tools)
    choice = plan_options(options, task, settings)
    ranking, draws = rank_tools(arguments, bench, choice, task, bounds)
    seen = {option.object_name: option.features for option in choice.options}
    expected = [expect(tool, bench.named.memory, settings, seen.get(tool.name)) for tool in tools]
    reasons = explain_choice(ranking, draws, choice.options)
    content = {
        "task": name,
        "robot": robot.name,
        "see": arguments.see,
        **tell_sources(arguments, robot, bench.named),
        "surprises": to_plain(draws.surprises),
        "remarks": [*bench.remarks, *remarks],
        **build_content(ranking, reasons, name_materials(tools, materials)),
        "expected": build_expectations(expected),
    }
    width = find_width()
    lines = [*describe_advice(content, width), *describe_expectations(content["expected"], width)]

    def draw() -> "Figure":
        # Imported here: these imports take most of a second, and runs without --out do not need them.
        from affordance.extensions.advice.advice_figure import draw_advice, render_choice

        return draw_advice(content, render_choice(settings.arm, ranking, {tool.name: tool for tool in tools}))

    give_answer(arguments, _NAME, break_lines(lines, width), content, draw)
    return 0


def _answer_payload(arguments: argparse.Namespace, robot: Robot, names: Sequence[str]) -> int:
    """Prints how much of each joint's effort limit remains in a task with a payload."""
    mass = check_number("--payload", arguments.payload, 0.0, _PAYLOAD_MAX, "kg")
    for value in arguments.payload_at:
        check_number("--payload-at", value, -_DISTANCE_MAX, _DISTANCE_MAX, "m")
    ((name, task),) = read_tasks(names, arguments.files, robot).items()
    settings = change_by_name(arguments, Settings(arm=robot.directives))
    demand = measure_payload(task, mass, np.array(arguments.payload_at), settings)
    limited = [each for each in demand["joints"] if np.isfinite(each["limit"])]
    least = min(limited or demand["joints"], key=lambda each: each["margin"] / each["limit"])
    verdict = "fits" if least["margin"] >= 0.0 else "is too heavy"
    place = " ".join(f"{each:g}" for each in arguments.payload_at)
    needed, limit = (format_number(least[key]) for key in ("needed", "limit"))
    sentence = (
        f"{format_number(mass)} kg at ({place}) m in the hand {verdict}: "
        f"{least['joint']} needs {needed} N m of {limit} N m at most."
    )
    rows = [["", "needs (N m)", "limit (N m)", "left (N m)"]]
    for each in demand["joints"]:
        values = [f"{each[key]:.2f}" for key in ("needed", "limit", "margin")]
        rows.append([each["joint"], *(values if each in limited else ["", "none", ""])])
    lines = [sentence, f"{name} with {robot.name}, including the arm's own weight and motion:"]
    lines += [f"  {line}" for line in tabulate(rows, (1, 2, 3), max(find_width() - 2, 0))]
    force, moment = (format_number(demand[key]) for key in ("grip_force", "grip_moment"))
    lines.append(f"  at the grip: {force} N, {moment} N m")
    payload = {"mass": mass, "position": list(arguments.payload_at)}
    content = {"task": name, "robot": robot.name, "payload": payload, **demand, "sentence": sentence}
    give_answer(arguments, _NAME, "\n".join(lines), content)
    return 0 if least["margin"] >= 0.0 else _TOO_HEAVY


def _run_demo(arguments: argparse.Namespace) -> int:
    """Ranks the package's hammers, with a memory of trials in the package."""
    check_alone(arguments, {"task": "a task", "files": "--task", "memory": "--memory"})
    teach = ["memory", "import", "demo.sqlite", TRIALS]
    announce(arguments, teach, ["rank", "hammer", "--memory", "demo.sqlite"])
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "demo.sqlite"
        with open_memory(place) as ledger:
            ledger.append(import_trials(TRIALS))
        arguments.demo, arguments.task, arguments.memory = False, "hammer", str(place)
        return run(arguments)
