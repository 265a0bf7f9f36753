"""``affordance study recorded``: identifies payloads in real recordings published by others."""

import argparse
from pathlib import Path

from affordance.arguments import REPEATS, check_whole
from affordance.commands.options import add_out, add_repeats, add_seed, check_bounds
from studies.recorded.study import NAME, StudyConfig, run_study

HELP = "identify what real robots held, by recordings in clones of public repositories"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    default = StudyConfig()
    parser.add_argument("--data", type=Path, required=True, help="folder with the clones, by the repositories' names")
    add_out(parser)
    add_repeats(parser, default.draws, "simulated truths of each kind", former=["--draws"])
    parser.add_argument(
        "--injections", type=int, default=default.injections, help="payloads for each length of window (default 200)"
    )
    add_seed(parser, default.seed)


def run(arguments: argparse.Namespace) -> int:
    """Runs the study.

    Raises:
        AffordanceError: An argument is out of bounds, or a recording is missing.
    """
    check_bounds(arguments)
    check_whole("--injections", arguments.injections, REPEATS)
    config = StudyConfig(arguments.injections, arguments.repeats, arguments.seed)
    print(f"The report: {run_study(arguments.data, arguments.out / NAME, config)}")
    return 0
