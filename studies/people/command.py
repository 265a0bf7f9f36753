"""``affordance study people``: fits the relative width of a category to two groups of people."""

import argparse
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.belief.learner import Learner
from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.commands.options import add_jobs, add_out, add_repeats, add_seed, add_set, change_by_name
from affordance.exceptions import BadValueError
from affordance.experiments.linear import GROUPS
from affordance.experiments.observers import Setup
from affordance.simulation.static_lifts import check_closed_form
from studies.people.figure import draw_kappa_fit
from studies.people.fit import Fraction, KappaFit, estimate_people_fraction, simulate_and_fit
from studies.study import Findings, Study, Work

_LEARNERS = (KINDS_MAP, KINDS_DRAWN)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 100, "simulated observers at each kappa")
    add_seed(parser, 1)
    add_jobs(parser)
    add_out(parser)
    add_set(parser)
    parser.add_argument("--lowest", type=float, default=0.12, help="smallest kappa (default 0.12)")
    parser.add_argument("--highest", type=float, default=0.48, help="largest kappa (default 0.48)")
    parser.add_argument("--count", type=int, default=13, help="how many values of kappa (default 13)")


def plan(arguments: argparse.Namespace) -> Work:
    """Checks the values of kappa and the settings."""
    if not 0.0 < arguments.lowest < arguments.highest:
        problem = f"is {arguments.lowest:g}, must be above 0 and below --highest, {arguments.highest:g}"
        raise BadValueError("--lowest", "", problem)
    settings = change_by_name(arguments)
    check_closed_form(settings)
    for option, value, least in (("--count", arguments.count, 3), ("--repeats", arguments.repeats, 2)):
        if value < least:
            raise BadValueError(option, "", f"is {value}, must be at least {least}")
    setup = Setup(arguments.repeats, arguments.seed, arguments.jobs, settings=settings)
    return partial(_work, arguments, setup)


def _work(arguments: argparse.Namespace, setup: Setup, folder: Path) -> Iterator[Findings]:
    people = [estimate_people_fraction(group) for group in GROUPS.values()]
    kappas = np.linspace(arguments.lowest, arguments.highest, arguments.count)
    numbers: dict[str, Any] = {}
    figures = {}
    for learner in _LEARNERS:
        start = time.perf_counter()
        fit = simulate_and_fit(setup.change(learner=learner), kappas, people)
        _print_fit(learner, fit, people)
        title = f"The fit of kappa to Linear+ and Linear++, {learner.name}"
        figures[learner.name] = partial(draw_kappa_fit, fit, people, title)
        numbers[learner.name] = {**fit._asdict(), "wall_s": time.perf_counter() - start}
    content = {
        "learners": numbers,
        "people": dict(zip(GROUPS, people, strict=True)),
        "seed": arguments.seed,
        "repeats": arguments.repeats,
    }
    yield Findings(content, figures=figures)


def _print_fit(learner: Learner, fit: KappaFit, people: list[Fraction]) -> None:
    print(f"{learner.name}: kappa {fit.kappa:.3f}, 95 % interval {fit.low:.3f} to {fit.high:.3f}", end="")
    print("" if fit.is_bounded else ", an interval that the simulated values do not bound on both sides")
    for column, (group, found) in enumerate(zip(GROUPS.values(), people, strict=True)):
        at_best = np.interp(fit.kappa, fit.kappas, fit.fractions[:, column])
        print(f"    {group.name:9s} f {at_best:.2f}, people {found.mean:.2f} [{found.low:.2f}, {found.high:.2f}]")
    for kappa, fractions, errors in zip(fit.kappas, fit.fractions, fit.fraction_ses, strict=True):
        cells = (f"{mean:6.3f} +- {se:.3f}" for mean, se in zip(fractions, errors, strict=True))
        log_likelihood = np.interp(kappa, fit.grid, fit.log_likelihood)
        print(f"    kappa {kappa:.3f}   f " + "   ".join(cells) + f"   log likelihood {log_likelihood:7.2f}")


STUDY = Study(
    "fit kappa, the breadth of a category, to Linear+ and Linear++",
    add_arguments,
    plan,
    folder="kappa",
    refused={("learner",): "kappa is fitted to every learner with kinds"},
)
