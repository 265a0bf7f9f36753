"""Option ``--same-colour`` of the commands that recall a lasting memory."""

import argparse
from collections.abc import Mapping

from affordance.exceptions import BadValueError
from affordance.memory.same_colours import SameColours, join_colours
from affordance.objects.colour import COLOUR_FORM, is_colour, parse_colour
from affordance.objects.materials import Material


def add_same_colours(parser: argparse.ArgumentParser) -> None:
    """Adds ``--same-colour``, for what two cameras see differently."""
    help_ = "colours that count as one, seen by two cameras, as #b5a642=#c0b050; more than once"
    parser.add_argument("--same-colour", action="append", default=[], metavar="A=B", help=help_)


def read_same_colours(arguments: argparse.Namespace, at_hand: Mapping[str, Material]) -> SameColours:
    """Reads pairs of colours, the first of each that of the material at hand, if it is of one.

    Anything else than colours, two materials at hand, or pairs without a memory raise a BadValueError.
    """
    pairs = []
    for word in arguments.same_colour:
        one, _, other = word.partition("=")
        if not (is_colour(one) and is_colour(other)):
            raise BadValueError("--same-colour", "", f"is {word!r}, must be two colours, each of which {COLOUR_FORM}")
        pairs.append((parse_colour(one), parse_colour(other)))
    if pairs and not arguments.memory:
        raise BadValueError("--same-colour", "", "is of what is remembered, must come with --memory")
    return join_colours(pairs, {name: material.colour for name, material in at_hand.items()})
