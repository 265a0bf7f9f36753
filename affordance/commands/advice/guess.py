"""``affordance guess``: estimates the inertia of objects from their appearance, before they are held."""

import argparse

from affordance.commands import answers, options
from affordance.commands.advice.workbench import (
    break_lines,
    know_materials,
    tell_sources,
)
from affordance.commands.terminal import find_width
from affordance.extensions.advice.advice_text import describe_knowledge, describe_surprise
from affordance.extensions.advice.expected_inertia import build_expectations, describe_expectations, expect
from affordance.extensions.memory.ledger import describe_past_arms
from affordance.objects.materials import MATERIALS, load_materials
from affordance.settings import Settings


def run(arguments: argparse.Namespace) -> int:
    """Prints the expected mass, centre of mass and inertia of objects and their parts."""
    robot = options.open_robot(arguments)
    settings = options.change_by_name(arguments, Settings(arm=robot.directives))
    materials = load_materials(arguments.materials or robot.folder / MATERIALS.name)
    tools, remarks = options.read_tools(arguments.tools, materials)
    named = know_materials(arguments, settings, tools, materials)
    expected = [expect(tool, named.memory, settings) for tool in tools]
    content = {
        **tell_sources(arguments, robot, named),
        "remarks": list(remarks),
        "expected": build_expectations(expected),
    }
    width = find_width()
    lines = [describe_past_arms(robot.name, content["trials_of_other_arms"])]
    lines += [f"warning: {each}" for each in remarks]
    lines += [describe_surprise(surprise) for each in expected for surprise in each.surprises]
    lines += describe_expectations(content["expected"], width, by_part=True)
    lines.append(f"materials: {describe_knowledge(content)}")
    answers.give_answer(arguments, "guess", break_lines(lines, width), content)
    return 0
