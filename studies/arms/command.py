"""``affordance study arms``: tests the paper's claims on the arms of many robots."""

import argparse
import logging
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed, add_set, change_by_name
from affordance.exceptions import BadValueError
from affordance.named_settings import parse_changes
from studies.arms.figure import draw_study
from studies.arms.report import describe
from studies.arms.robot_study import RunConfig, study_ours, study_robot
from studies.arms.robots import ROBOTS, Robot, find_folder
from studies.study import Findings, Study, Work, add_only

_LOG = logging.getLogger(__name__)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--robots", type=Path, required=True, help="folder that the wheel was installed into, or its folder robots/"
    )
    add_only(parser, [robot.name for robot in ROBOTS], "robots")
    add_repeats(parser, 20, "simulated observers of each experiment")
    add_seed(parser)
    add_jobs(parser, 1)
    add_out(parser, "results/arms")
    add_set(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Checks settings and robots."""
    change_by_name(arguments)
    chosen = choose_robots(arguments.robots, arguments.only)
    changes = tuple(parse_changes(arguments.changes).items())
    config = RunConfig(arguments.seed, arguments.repeats, changes)
    return partial(_work, chosen, find_folder(arguments.robots), config, arguments.jobs)


def choose_robots(folder: Path, only: Sequence[str] = ()) -> list[Robot]:
    """Returns the robots to study: those in ``only``, or all of them if it is empty.

    Raises:
        BadValueError: The folder has no file of these robots.
    """
    chosen = [robot for robot in ROBOTS if not only or robot.name in only]
    if not any((find_folder(folder) / robot.file).is_file() for robot in chosen):
        problem = f"is {str(folder)!r}, which has no file of these robots, such as {chosen[0].file}"
        wheel = "pip install --target FOLDER --no-deps example-robot-data==6.0.0 puts them into FOLDER"
        raise BadValueError("--robots", "", f"{problem}; {wheel}")
    return chosen


def _work(chosen: Sequence[Robot], robots: Path, config: RunConfig, jobs: int, out: Path) -> Iterator[Findings]:
    """Studies one robot after the other; stores each result, and writes all results so far after each robot."""
    found: dict[str, Any] = {}
    for robot in chosen:
        _LOG.info("%s", robot.name)
        found[robot.name] = study_robot(robot, robots, config, out, jobs)
        ours = study_ours(config, out, jobs)
        details = {
            name: {key: value for key, value in one.items() if key != "metrics"} for name, one in found.items()
        }
        yield Findings(
            {"robots": {name: one["metrics"] for name, one in found.items()}},
            describe(found, ours),
            figures={"arms": partial(draw_study, found, ours)},
            details={"robots": details, "ours": ours},
        )


STUDY = Study("test the paper's claims on the arms in the wheel example-robot-data", add_arguments, plan, folder="")
