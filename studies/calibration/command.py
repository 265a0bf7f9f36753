"""``affordance study calibration``: calibration of beliefs, and choices with other measurement errors."""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from affordance.commands.arguments import add_jobs, add_out, add_repeats
from studies.calibration import calibration, sensing
from studies.calibration.report import describe, draw_ranks
from studies.study import Findings, Study, Work

# Number of draws per observer in the simulation of choices.
_DRAWS_PER_OBSERVER = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    what = (
        f"pairs of densities that are drawn from the prior; a {_DRAWS_PER_OBSERVER}th as many observers choose grips"
    )
    add_repeats(parser, calibration.NUM_DRAWS, what)
    add_jobs(parser)
    add_out(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans both parts."""
    return partial(_work, arguments.repeats, arguments.jobs)


def _work(draws: int, jobs: int, folder: Path) -> Iterator[Findings]:
    found, numbers = calibration.measure(folder, draws=draws, jobs=jobs)
    observers = max(1, draws // _DRAWS_PER_OBSERVER)
    numbers |= {
        "p_correct_by_sensing": sensing.measure(folder, repeats=observers, jobs=jobs),
        "sensing_observers": observers,
        "repeats": draws,
    }
    names = [part.material.name for part in calibration.load_stick().components]
    yield Findings(numbers, describe(numbers), {"ranks": partial(draw_ranks, found, names)})


STUDY = Study(
    "whether beliefs are as uncertain as they should be, and choices with other errors of measurement",
    add_arguments,
    plan,
    on_one_thread=True,
)
