"""``affordance study loop``: runs the whole loop on imported robots, from recordings of stock to choosing a tool."""

import argparse
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from affordance.arguments import check_whole
from affordance.choice.demand import Criterion
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from affordance.exceptions import BadValueError
from affordance.files.constraints import Whole
from affordance.robots.kept import open_robot
from studies.arms.robots import ROBOTS, Robot, find_folder
from studies.loop.execution import execute
from studies.loop.figure import draw_loop
from studies.loop.ledger_speed import measure_ledger
from studies.loop.record import print_recorded, write_demo
from studies.loop.recordings import MOTORS, TORQUE_SENSORS
from studies.loop.report import describe
from studies.loop.study import (
    LoopConfig,
    build_bench,
    describe_robot,
    run_life,
    start_life,
    summarise_robots,
    time_ranking,
)
from studies.study import Findings, Study, Task, Work, add_only, run_kept

# Robots that are studied, each with whether it has joint torque sensors.
_STUDIED = {"panda": True, "ur5": False, "xarm7": False}
_TRIALS = Whole(10, 10_000_000)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    what = "folder in which example-robot-data is installed, or its folder robots/"
    parser.add_argument("--robots", type=Path, metavar="DIR", help=what)
    add_only(parser, _STUDIED, "robots")
    parser.add_argument("--trials", type=int, default=100_000, help="number of trials in the timed ledger")
    what = "only record stock on one robot (a folder from import-arm), and write files like a user's logs to --out"
    parser.add_argument("--record", type=Path, metavar="DIR", help=what)
    parser.add_argument("--motors", action="store_true", help="with --record: motor torques, not torque sensors")
    what = "record the packaged data of identify --demo and rank --demo again"
    parser.add_argument("--demo", action="store_true", help=what)
    add_repeats(parser, 50, "simulated observers on each robot")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work | Task:
    """Plans the lives on the robots after checking these, or plans recordings."""
    if arguments.demo:
        return Task(write_demo)
    if arguments.record is not None:
        signals = MOTORS if arguments.motors else TORQUE_SENSORS
        return Task(partial(print_recorded, arguments.record, arguments.out, signals, arguments.seed))
    check_whole("--trials", arguments.trials, _TRIALS)
    if arguments.robots is None:
        raise BadValueError("--robots", "", "is missing, must be a folder in which example-robot-data is installed")
    folder = find_folder(arguments.robots)
    chosen = [each for each in ROBOTS if each.name in (arguments.only or _STUDIED)]
    for robot in chosen:
        if not (folder / robot.file).is_file():
            raise BadValueError(
                "--robots", "", f"has no {robot.file}, must be a folder in which example-robot-data is installed"
            )
    return partial(_work, chosen, folder, arguments)


def _work(chosen: Sequence[Robot], robots: Path, arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    metrics: dict[str, Any] = {}
    details: dict[str, Any] = {}
    timed: LoopConfig | None = None
    for robot in chosen:
        imported = open_robot(robots / robot.file, robot.options, folder / "robots")
        config = LoopConfig(imported.folder, _STUDIED[robot.name], arguments.seed)
        timed = timed or config
        arrays = run_kept(
            config,
            run_life,
            folder,
            imported.folder,
            repeats=arguments.repeats,
            jobs=arguments.jobs,
            description=f"loop: {robot.name}",
        )
        metrics[robot.name], details[robot.name] = describe_robot(arrays)
        metrics[robot.name]["executed"] = execute_choices(config, Criterion(metrics[robot.name]["by"]))
    assert timed is not None
    memory = measure_ledger(arguments.trials)
    numbers = {
        "repeats": arguments.repeats,
        "seed": arguments.seed,
        "robots": metrics,
        "memory": memory,
        "rank_seconds": time_ranking(timed),
        **summarise_robots(metrics),
        **{name: memory[name] for name in ("recall_s_1e5", "lost", "double", "forget_error")},
    }
    yield Findings(numbers, describe(numbers), details=details, figures={"loop": partial(draw_loop, details)})


def execute_choices(config: LoopConfig, criterion: Criterion) -> dict[str, Any]:
    """Simulates, with contact, what the first observer chooses after all pieces."""
    bench = build_bench(config)
    *_, memory = start_life(config, bench, 0).memories.values()
    return execute(bench, memory, criterion, config.seed)


STUDY = Study(
    "run the whole loop on imported robots: recordings of stock, a lasting memory, choices of tools",
    add_arguments,
    plan,
)
