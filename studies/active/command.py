"""``affordance study active``: what to hold next, how to move while weighing, and when to stop."""

import argparse
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from affordance.arguments import check_whole
from affordance.arrays import Arrays
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed
from affordance.files.constraints import Whole
from affordance.files.model_folder import MODELS
from studies.active import stopping
from studies.active.brute_force import CASES, WorthConfig, compare_worth, describe_worths
from studies.active.figure import draw_rules
from studies.active.kinds import compare_information
from studies.active.repeats import RepeatsConfig, describe_repeats, run_block
from studies.active.report import describe
from studies.active.rules import RULES
from studies.active.study import (
    PAPER_HORIZON,
    ActiveConfig,
    describe_paper_world,
    describe_rules,
    run_observer,
    time_advice,
)
from studies.active.world import build_paper_world
from studies.excite.study import check_recordings, measure_motions
from studies.study import Findings, Study, Work, run_kept

_COUNT = Whole(1, 100_000)
# Number of blocks, each of a hundred observers that hold one object repeatedly.
_BLOCKS = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("--data", type=Path, metavar="DIR", help="recordings as for study recorded, to study motions (default: none)")
    add("--pools", type=int, default=100, metavar="N", help="number of pools of recorded postures (default 100)")
    add("--designs", type=int, default=1, metavar="N", help="number of designs of each motion (default 1)")
    add_repeats(parser, 200, "simulated observers of each rule in the workshop")
    add(
        "--paper",
        type=int,
        default=100,
        metavar="N",
        help="observers of each rule in the paper's world (default 100)",
    )
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Checks the recordings, and returns the work to be done."""
    for name in ("pools", "designs", "paper"):
        check_whole(f"--{name}", getattr(arguments, name), _COUNT)
    if arguments.data is not None:
        check_recordings(arguments.data)
    return partial(_work, arguments)


def _work(arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    def run[C](config: C, observe: Callable[[C, int], Arrays], repeats: int, name: str) -> Arrays:
        return run_kept(
            config, observe, folder, MODELS, repeats=repeats, jobs=arguments.jobs, description=f"active: {name}"
        )

    seed, repeats = arguments.seed, arguments.repeats

    def run_rules(name: str, repeats: int, **config: Any) -> dict[str, Arrays]:
        return {
            rule: run(ActiveConfig(rule, seed, **config), run_observer, repeats, f"{name}, {rule}") for rule in RULES
        }

    workshop = run_rules("workshop", repeats, is_simulated=True)
    paper = run_rules("the paper's world", arguments.paper, tasks=(), horizon=PAPER_HORIZON)
    stops = {
        name: stopping.describe_stops(run(config, stopping.run_observer, number, name))
        for name, (config, number) in stopping.list_configs(seed, repeats).items()
    }
    described = {
        **describe_rules(workshop),
        **describe_paper_world(paper, [each.name for each in build_paper_world().questions]),
    }
    numbers: dict[str, Any] = {
        "repeats": repeats,
        "paper_repeats": arguments.paper,
        "seed": seed,
        **described,
        **stopping.summarise(stops),
        **describe_worths(run(WorthConfig(), compare_worth, len(CASES), "worths")),
        **describe_repeats(run(RepeatsConfig(seed=seed), run_block, _BLOCKS, "repeated holds, hundreds")),
        **compare_information(),
        "ms_per_candidate": time_advice(),
        "has_motions": arguments.data is not None,
    }
    rules = {"workshop": described["workshop"]["rules"], "the paper's world": described["paper_world"]["rules"]}
    figures: dict[str, Callable[[], Figure]] = {"active": partial(draw_rules, rules)}
    if arguments.data is not None:
        of_motions, drawn = measure_motions(
            arguments.data,
            folder,
            pools=arguments.pools,
            designs=arguments.designs,
            seed=seed,
            jobs=arguments.jobs,
        )
        numbers |= of_motions
        figures |= drawn
    yield Findings(numbers, describe(numbers), figures)


STUDY = Study(
    "what to hold next before tools are chosen, how to move while weighing, and when to stop", add_arguments, plan
)
