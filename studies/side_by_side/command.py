"""``affordance study side_by_side``: compares finished runs of the paper's simulations."""

import argparse
from pathlib import Path

from affordance.commands.options import add_out
from affordance.exceptions import BadValueError
from affordance.runs.repeats import prepare_folder
from studies.side_by_side import sources, tasks
from studies.study import write_findings

HELP = "compare finished runs: choices for both tasks, and true features with pictures"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_out(parser)
    parser.add_argument(
        "--pixels", type=Path, metavar="DIR", help="results of the same experiments, run with --vision pixels"
    )


def run(arguments: argparse.Namespace) -> int:
    """Compares what there is and writes a section for each comparison.

    Raises:
        BadValueError: There is nothing to compare, a file is not that of a finished run, or runs differ in more than
            what is compared; nothing was written.
    """
    out: Path = arguments.out
    found = {tasks: tasks.compare_tasks(out)}
    if arguments.pixels is not None:
        found[sources] = sources.compare_sources(out, arguments.pixels)
        if found[sources] is None:
            raise BadValueError("--pixels", "", f"is '{arguments.pixels}', which holds no experiment of {out}")
    written = ""
    for study, findings in found.items():
        if findings is not None:
            written = str(write_findings(findings, prepare_folder(out) / study.NAME, study.SECTION))
    if not written:
        raise BadValueError("--out", "", f"is '{out}', must hold both {' and '.join(tasks.TASKS)}, or give --pixels")
    print(f"The report: {written}")
    return 0
