"""``affordance study side_by_side``: compares finished runs of the paper's simulations."""

import argparse
from pathlib import Path

from affordance.commands.options import add_out
from affordance.exceptions import BadValueError
from studies.side_by_side.sources import compare_sources
from studies.side_by_side.tasks import TASKS, compare_tasks
from studies.study import Study, Work


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_out(parser)
    parser.add_argument(
        "--pixels",
        type=Path,
        metavar="DIR",
        help="results of the same experiments, run with --vision pixels, to compare with those of --out instead",
    )


def plan(arguments: argparse.Namespace) -> Work:
    """Compares what there is."""
    out: Path = arguments.out
    if arguments.pixels is not None:
        found = compare_sources(out, arguments.pixels)
        if found is None:
            raise BadValueError("--pixels", "", f"is '{arguments.pixels}', which holds no experiment of {out}")
    else:
        found = compare_tasks(out)
        if found is None:
            raise BadValueError("--out", "", f"is '{out}', must hold both {' and '.join(TASKS)}, or give --pixels")
    return lambda folder: [found]


STUDY = Study(
    "compare finished runs: choices for both tasks, or true features with pictures", add_arguments, plan, folder=""
)
