"""``affordance study people``: fits kappa, the relative breadth of a category, to two groups of participants."""

import argparse
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.belief.learner import Learner
from affordance.belief.learners import KINDS_DRAWN, KINDS_MAP
from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed, add_set
from affordance.commands.options import change_by_name
from affordance.exceptions import BadValueError
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.experiments.lifts import cylinder
from affordance.extensions.people.experiments.linear import GROUPS
from affordance.extensions.people.static_lifts import check_closed_form
from affordance.objects.tool import Tool
from studies.people.figure import draw_kappa_fit
from studies.people.fit import Fraction, KappaFit, estimate_people_fraction, simulate_and_fit, simulate_fractions
from studies.study import Findings, Study, Task, Work

_LEARNERS = (KINDS_MAP, KINDS_DRAWN)
LEAST_VOLUME = 0.01  # smallest scale factor of volumes; the largest is its inverse


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
    what = "fit nothing; compute f of Linear++ with all volumes multiplied by each V, at the same masses and seeds"
    parser.add_argument("--volumes", type=float, nargs="+", metavar="V", help=what)


def plan(arguments: argparse.Namespace) -> Work | Task:
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
    if arguments.volumes is None:
        return partial(_work, arguments, setup)
    for value in arguments.volumes:
        if not LEAST_VOLUME <= value <= 1.0 / LEAST_VOLUME:
            nearest = min(max(value, LEAST_VOLUME), 1.0 / LEAST_VOLUME)
            problem = (
                f"is {value:g}, must be from {LEAST_VOLUME:g} to {1.0 / LEAST_VOLUME:g}; the nearest is {nearest:g}"
            )
            raise BadValueError("--volumes", "", problem)
    return Task(partial(compare_volumes, setup, arguments.volumes))


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


def compare_volumes(setup: Setup, volumes: Sequence[float]) -> int:
    """Prints the mean learned fraction f in Linear++, with its standard error, for each scale factor of all volumes.

    For all factors but the first, the difference from the first factor is printed, too.
    """
    for learner in _LEARNERS:
        found: list[Array] = []
        for factor in volumes:
            tools = [scale_volume(tool, factor) for tool in linear.make_objects("linear_plus_plus")]
            fractions = simulate_fractions(setup.change(learner=learner), tools, f"volume {factor:g}")
            se = fractions.std(ddof=1) / np.sqrt(setup.observers)
            print(f"{learner.name}: volumes times {factor:g}: f {fractions.mean():.4f} +- {se:.4f}")
            if found:
                apart = fractions - found[0]
                se = apart.std(ddof=1) / np.sqrt(setup.observers)
                print(f"    minus that of times {volumes[0]:g}: {apart.mean():+.4f} +- {se:.4f}")
            found.append(fractions)
    return 0


def scale_volume(tool: Tool, factor: float) -> Tool:
    """Builds a cylinder with the same mass and scaled volume."""
    radius, height = factor ** (1.0 / 3.0) * np.array(tool.components[0].shape.sizes)
    return cylinder(tool.name, radius=radius, height=height, mass=tool.mass)


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
