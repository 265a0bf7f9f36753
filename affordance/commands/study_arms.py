"""``affordance study arms``: tests the paper's claims on the arms of many robots."""

import argparse
from pathlib import Path

from affordance.commands.options import (
    add_jobs,
    add_out,
    add_repeats,
    add_seed,
    add_set,
    change_by_name,
    check_bounds,
)
from affordance.experiments.arms.study import StudyConfig, check_config, run_study
from affordance.named_settings import parse_changes

HELP = "the paper's claims on the arms of the wheel example-robot-data"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--robots", type=Path, required=True, help="folder that the wheel was installed into, or its folder robots/"
    )
    parser.add_argument("--only", nargs="+", default=[], metavar="ROBOT", help="some of the robots (default: all)")
    add_repeats(parser, 20, "simulated observers of each experiment")
    add_seed(parser)
    add_jobs(parser, 1)
    add_out(parser, "results/arms")
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Runs the study; returns the exit status.

    Raises:
        AffordanceError: An argument is invalid; nothing was written.
    """
    check_bounds(arguments)
    change_by_name(arguments)
    config = StudyConfig(
        arguments.robots,
        arguments.seed,
        arguments.repeats,
        arguments.jobs,
        tuple(arguments.only),
        tuple(parse_changes(arguments.changes).items()),
    )
    check_config(config)
    print(f"The numbers: {run_study(config, arguments.out)}")
    return 0
