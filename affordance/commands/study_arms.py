"""affordance study arms: the paper's claims across the arms of many robots."""

import argparse
from pathlib import Path

from affordance.experiments.arms.study import StudyConfig, check_config, run_study

HELP = "the paper's claims on the arms of the wheel example-robot-data"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the study's arguments."""
    parser.add_argument(
        "--robots", type=Path, required=True, help="folder that the wheel was installed into, or its folder robots/"
    )
    parser.add_argument("--only", nargs="+", default=[], metavar="ROBOT", help="some of the robots (default: all)")
    parser.add_argument("--repeats", type=int, default=20, help="simulated observers of each experiment (default 20)")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument(
        "--out", type=Path, default=Path("results/arms"), help="folder for the results (default results/arms)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Runs the study; returns the exit status.

    Raises:
        AffordanceError: An argument is not what it must be; nothing was written.
    """
    config = StudyConfig(arguments.robots, arguments.seed, arguments.repeats, arguments.jobs, tuple(arguments.only))
    check_config(config)
    print(f"The numbers: {run_study(config, arguments.out)}")
    return 0
