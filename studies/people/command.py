"""``affordance study people``: fits the relative width of a category to two groups of people."""

import argparse
import time
from typing import Any

import numpy as np
from scipy.stats import chi2

from affordance.belief.learner import Learner
from affordance.commands.options import add_run_options, change_by_name, check_bounds, refuse_changes
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_json
from affordance.reporting.figures import save_figure
from affordance.runs.repeats import list_versions, prepare_folder
from affordance.simulation.static_lifts import check_closed_form
from studies.people.figures import Interval, draw_kappa_fit
from studies.people.fit import GROUPS, KappaFit, load_groups, load_people, simulate_and_fit
from studies.people.fraction import Fraction, estimate_people_fraction

HELP = "fit kappa, the breadth of a category, to Linear+ and Linear++"
_TITLES = ("Linear+", "Linear++")
_LEARNERS = (Learner.KINDS_MAP, Learner.KINDS_DRAWN)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_run_options(parser, 100, "simulated observers at each kappa", seed=1, models="people/, the published values")
    parser.add_argument("--lowest", type=float, default=0.12, help="smallest kappa (default 0.12)")
    parser.add_argument("--highest", type=float, default=0.48, help="largest kappa (default 0.48)")
    parser.add_argument("--count", type=int, default=13, help="how many values of kappa (default 13)")


def run(arguments: argparse.Namespace) -> int:
    """Fits kappa for each learner with kinds, prints it, and writes OUT/kappa/.

    Raises:
        BadValueError: An option is out of bounds, or a file with human data is invalid.
    """
    if not 0.0 < arguments.lowest < arguments.highest:
        problem = f"is {arguments.lowest:g}, must be more than 0 and less than --highest, {arguments.highest:g}"
        raise BadValueError("--lowest", "", problem)
    check_bounds(arguments)
    refuse_changes(arguments, ["learner"], "kappa is fitted to every learner with kinds")
    settings = change_by_name(arguments)
    check_closed_form(settings)
    for option, value, least in (("--count", arguments.count, 3), ("--repeats", arguments.repeats, 2)):
        if value < least:
            raise BadValueError(option, "", f"is {value}, must be at least {least}")
    folder = prepare_folder(arguments.out) / "kappa"
    groups = load_groups(arguments.models, arguments.seed, settings)
    people = [estimate_people_fraction(load_people(group)) for group in groups]
    kappas = np.linspace(arguments.lowest, arguments.highest, arguments.count)
    numbers: dict[str, Any] = {}
    for learner in _LEARNERS:
        start = time.perf_counter()
        fit = simulate_and_fit(
            learner,
            kappas,
            people,
            groups,
            repeats=arguments.repeats,
            jobs=arguments.jobs,
        )
        _report(learner, fit, people)
        save_figure(_draw(learner, fit, people), folder, learner.value)
        numbers[learner.value] = {**fit._asdict(), "wall_s": time.perf_counter() - start}
    content = {
        "learners": numbers,
        "people": dict(zip(GROUPS, people, strict=True)),
        "seed": arguments.seed,
        "repeats": arguments.repeats,
        "versions": list_versions(),
    }
    write_json(folder / "metrics.json", content)
    return 0


def _report(learner: Learner, fit: KappaFit, people: list[Fraction]) -> None:
    print(f"{learner.value}: kappa {fit.kappa:.3f}, 95 % interval {fit.low:.3f} to {fit.high:.3f}", end="")
    print("" if fit.is_bounded else ", which what was simulated does not bound on both sides")
    for group, found, column in zip(_TITLES, people, range(len(_TITLES)), strict=True):
        at_best = np.interp(fit.kappa, fit.kappas, fit.fractions[:, column])
        print(f"    {group:9s} f {at_best:.2f}, people {found.mean:.2f} [{found.low:.2f}, {found.high:.2f}]")
    for kappa, fractions, errors in zip(fit.kappas, fit.fractions, fit.fraction_ses, strict=True):
        cells = (f"{mean:6.3f} +- {se:.3f}" for mean, se in zip(fractions, errors, strict=True))
        log_likelihood = np.interp(kappa, fit.grid, fit.log_likelihood)
        print(f"    kappa {kappa:.3f}   f " + "   ".join(cells) + f"   log likelihood {log_likelihood:7.2f}")


def _draw(learner: Learner, fit: KappaFit, people: list[Fraction]) -> Any:
    return draw_kappa_fit(
        {group: (fit.fractions[:, column], fit.fraction_ses[:, column]) for column, group in enumerate(_TITLES)},
        [Interval(found.mean, found.low, found.high) for found in people],
        (fit.grid, fit.log_likelihood),
        kappas=fit.kappas,
        best=Interval(fit.kappa, fit.low, fit.high),
        threshold=-0.5 * float(chi2.ppf(0.95, 1)),
        title=f"The fit of kappa to Linear+ and Linear++, {learner.value}",
    )
