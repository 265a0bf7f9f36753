"""Arguments of the commands for live views."""

import argparse

from affordance.commands.arguments import add_learner, add_memory, add_robot, add_seed, add_set
from affordance.commands.catalogue import OF_THE_PAPER


def declare_watch(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of ``watch``."""
    what = f"{', '.join(OF_THE_PAPER)} (default: weight)"
    parser.add_argument("experiment", nargs="?", default="weight", help=what)
    add_robot(parser)
    add_seed(parser)
    add_set(parser)
    add_learner(parser)
    add_memory(parser)
