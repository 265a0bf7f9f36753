"""Options of a lasting memory, and what they change in a run."""

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING

from affordance.commands.options import tell
from affordance.exceptions import BadValueError
from affordance.extensions.memory.past_arms import count_of, describe_past_arms
from affordance.extensions.memory.same_colours import SameColours, join_colours
from affordance.objects.colour import COLOUR_FORM, is_colour, parse_colour
from affordance.objects.materials import MATERIALS, Material, load_materials

if TYPE_CHECKING:
    from affordance.experiments.shared.observers import Setup
    from affordance.robot import Robot


def remember(setup: "Setup", arguments: argparse.Namespace, robot: "Robot") -> "Setup":
    """Returns the setup of an observer that starts with the memory of ``--memory``."""
    from affordance.extensions.memory.lasting_memory import remember_in  # imported here, as it takes long

    materials = load_materials(robot.folder / MATERIALS.name) if arguments.same_colour else {}
    pairs = read_same_colours(arguments, materials)
    if past := describe_past_arms(robot.name, count_of(robot, arguments.memory)):
        tell(arguments, past)
    return remember_in(setup, arguments.memory, pairs)


def read_same_colours(arguments: argparse.Namespace, at_hand: Mapping[str, Material]) -> SameColours:
    """Reads the pairs of colours of ``--same-colour``.

    If one colour of a pair is that of a material at hand, it is the first of the returned pair.

    Raises:
        BadValueError: If a word is not a colour, both colours are those of materials at hand, or pairs are given
            without ``--memory``.
    """
    pairs = []
    for word in arguments.same_colour:
        one, _, other = word.partition("=")
        if not (is_colour(one) and is_colour(other)):
            raise BadValueError("--same-colour", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
        pairs.append((parse_colour(one), parse_colour(other)))
    if pairs and not arguments.memory:
        raise BadValueError("--same-colour", "", "applies to remembered colours, must be given with --memory")
    return join_colours(pairs, {name: material.colour for name, material in at_hand.items()})
