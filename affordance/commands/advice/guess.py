"""``affordance guess``: estimates the inertia of objects from how they look, before any is held."""

import argparse
from pathlib import Path

from affordance.commands import options
from affordance.commands.advice.workbench import add_know, know_materials, recall_memory
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError, describe_choice
from affordance.extensions.advice.advice_text import describe_knowledge, describe_surprise
from affordance.extensions.advice.expected_inertia import build_expectations, describe_expectations, expect
from affordance.extensions.memory.ledger import count_of, describe_past_arms
from affordance.objects.load import load_tools
from affordance.objects.materials import MATERIALS, load_materials
from affordance.reporting.formatting import break_line
from affordance.settings import Settings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("tools", type=Path, help="tools file; it needs no grips")
    add("--only", action="append", default=[], metavar="NAME", help="only the object with this name; may be repeated")
    add("--meshes", type=Path, metavar="DIR", help="folder of mesh files (default: that of the tools file)")
    add("--materials", type=Path, metavar="FILE", help="materials (default: the robot's)")
    add("--memory", metavar="MEMORY", help="lasting memory of materials, an SQLite file (default: none)")
    add_know(parser)
    options.add_answer(parser, "guess.json and .txt")
    options.add_robot(parser)
    options.add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints the expected mass, centre of mass and inertia of objects and their parts."""
    robot = options.open_robot(arguments)
    settings = options.change_by_name(arguments, Settings(arm=robot.directives))
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools = load_tools(arguments.tools, materials, arguments.meshes)
    known = {tool.name: tool for tool in tools}
    for name in arguments.only:
        if name not in known:
            raise BadValueError(arguments.tools, "--only", describe_choice(name, known))
    memory = recall_memory(arguments.memory, settings)
    chosen = [known[name] for name in arguments.only] or list(tools)
    named = know_materials(arguments, memory, chosen, materials, settings.prior)
    expected = [expect(tool, named.memory, settings) for tool in chosen]
    num_past = count_of(robot, arguments.memory)
    cautions = [describe_past_arms(robot.name, num_past)] if num_past else []
    name = Path(arguments.memory).name if arguments.memory else None
    knowledge = f"materials: {describe_knowledge(named, name or '')}"
    width = find_width()
    cautions += [describe_surprise(surprise) for each in expected for surprise in each.surprises]
    lines = [*cautions, *describe_expectations(expected, width, by_part=True), knowledge]
    text = "\n".join(part for line in lines for part in break_line(line, width))
    content = {
        "memory": name,
        "known": list(named.by_name),
        "learned": list(named.learned),
        "unknown": list(named.unknown),
        "trials_of_other_arms": num_past,
        "expected": build_expectations(expected),
    }
    options.give_answer(arguments, "guess", text, content)
    return 0
