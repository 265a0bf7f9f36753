"""``affordance study recorded``: identification on real recordings that others published."""

import argparse
from pathlib import Path

from affordance.exceptions import BadValueError
from affordance.experiments.recorded.study import NAME, StudyConfig, run_study
from affordance.reporting.report import write_report

HELP = "identify what real robots held, by recordings in clones of public repositories"
# Fewer say nothing; more than anyone has patience for is a slip of the finger.
BOUNDS = {"injections": (1, 100_000), "draws": (1, 100_000), "seed": (0, 2**32 - 1)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    default = StudyConfig()
    parser.add_argument("--data", type=Path, required=True, help="folder with the clones, by the repositories' names")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument(
        "--injections", type=int, default=default.injections, help="payloads for each length of window (default 200)"
    )
    parser.add_argument(
        "--draws", type=int, default=default.draws, help="simulated truths of each kind (default 500)"
    )
    parser.add_argument("--seed", type=int, default=default.seed, help="of every random draw (default 0)")


def run(arguments: argparse.Namespace) -> int:
    """Runs the study.

    Raises:
        AffordanceError: An argument is out of bounds, or a recording is not there.
    """
    for name, (low, high) in BOUNDS.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise BadValueError(f"--{name}", "", f"is {value}, must be from {low} to {high}")
    config = StudyConfig(arguments.injections, arguments.draws, arguments.seed)
    run_study(arguments.data, arguments.out / NAME, config)
    print(f"The report: {write_report(arguments.out)}")
    return 0
