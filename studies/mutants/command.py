"""``affordance study mutants``: breaks the program in randomly drawn places and sees whether the tests notice."""

import argparse
from functools import partial

from affordance.arguments import check_whole
from affordance.commands.options import add_seed
from affordance.files.constraints import Whole
from studies.study import Study, Task, add_only, import_part

FOLDERS = (
    "belief",
    "proprioception",
    "plant",
    "control",
    "choice",
    "identification",
    "studies/robustness",
    "studies/recorded",
    "studies/hammering",
)
_NUMBER = Whole(1, 100_000)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_only(parser, FOLDERS, "folders")
    parser.add_argument("--survivors", action="store_true", help="only mutants that survived when last tried")
    parser.add_argument("--draw", type=int, metavar="N", help="draw another sample of N mutants, and try none")
    add_seed(parser)


def plan(arguments: argparse.Namespace) -> Task:
    """Imports what tries mutants, or draws them."""
    if arguments.draw is not None:
        number = check_whole("--draw", arguments.draw, _NUMBER)
        draw = import_part("studies.mutants.draw", extra="mutation").replace_sample
        return Task(partial(draw, number, arguments.seed))
    try_sample = import_part("studies.mutants.run").try_sample
    return Task(partial(try_sample, arguments.only or FOLDERS, only_survivors=arguments.survivors))


STUDY = Study(
    "break the program in randomly drawn places and see whether the tests notice; fills docs/mutants.md",
    add_arguments,
    plan,
    on_one_thread=True,
)
