"""``affordance study loop``: closes the loop on imported robots, from recordings of stock to the choice of a tool."""

import argparse
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from affordance.arguments import check_whole
from affordance.choice.demand import Criterion
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from affordance.exceptions import BadValueError, describe_choice
from affordance.files.constraints import Whole
from affordance.robots.kept import open_robot
from studies.arms.robots import ROBOTS, Robot, find_folder
from studies.loop.execution import execute
from studies.loop.figure import draw_loop
from studies.loop.ledger_speed import measure_ledger
from studies.loop.study import (
    LoopConfig,
    build_bench,
    describe_robot,
    run_life,
    start_life,
    summarise_robots,
    time_ranking,
)
from studies.study import Findings, Study, Work, run_kept

# Robots that are studied, and whether they have torque sensors at their joints.
_STUDIED = {"panda": True, "ur5": False, "xarm7": False}
_TRIALS = Whole(10, 10_000_000)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--robots", type=Path, required=True, help="folder that example-robot-data was installed into, or its robots/"
    )
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="ROBOT", help=f"some of {', '.join(_STUDIED)} (default: all)"
    )
    parser.add_argument("--trials", type=int, default=100_000, help="trials of the ledger that is timed")
    add_repeats(parser, 50, "simulated observers on each robot")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Checks the robots.

    Raises:
        BadValueError: The name of a robot is unknown, or the folder lacks its file.
    """
    check_whole("--trials", arguments.trials, _TRIALS)
    for name in arguments.only:
        if name not in _STUDIED:
            raise BadValueError("--only", "", describe_choice(name, _STUDIED))
    folder = find_folder(arguments.robots)
    chosen = [each for each in ROBOTS if each.name in (arguments.only or _STUDIED)]
    for robot in chosen:
        if not (folder / robot.file).is_file():
            raise BadValueError("--robots", "", f"has no {robot.file}, must be an installed example-robot-data")
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
        **{name: memory[name] for name in ("recall_ms_1e5", "lost", "double", "forget_error")},
    }
    yield Findings(numbers=numbers, details=details, figures={"loop": partial(draw_loop, details)})


def execute_choices(config: LoopConfig, criterion: Criterion) -> dict[str, Any]:
    """Simulates in full what the first observer chooses after all pieces."""
    bench = build_bench(config)
    *_, memory = start_life(config, bench, 0).memories.values()
    return execute(bench, memory, criterion, config.seed)


STUDY = Study(
    HELP="the whole loop on imported robots: recordings of stock, a lasting memory, tools chosen and judged",
    add_arguments=add_arguments,
    plan=plan,
    folder="loop",
    section=Path(__file__).with_name("section.yaml"),
)
