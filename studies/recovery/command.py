"""``affordance study recovery``: recovery of learners and kappa from pushes of simulated participants."""

import argparse
import math
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import nctdtr, stdtrit

from affordance.belief.learners import KINDS_DRAWN
from affordance.commands.arguments import add_jobs, add_out, add_repeats, add_seed
from affordance.exceptions import BadValueError
from affordance.extensions.people.experiments import linear
from affordance.extensions.people.likelihood import list_free
from affordance.extensions.people.participant import Participant
from affordance.files.model_folder import MODELS
from studies.recovery.groups import GroupRecovery, list_rows, recover_groups
from studies.recovery.people import PUSH_ERROR, Recovery, list_rivals, recover
from studies.study import Findings, Study, Work, format_table, run_kept

_LIFTS = (160, 220, 320)
_SIZES = (9, 15, 30)
_ALPHA, _POWER = 0.05, 0.8  # significance level and power of one-sided tests
_KAPPA_SPREAD = 0.3  # assumed SD of log kappa between participants


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, 6, "simulated people of each learner, or of each condition")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)
    what = "values of the parameters (default 16; with --groups 256)"
    parser.add_argument("--draws", type=int, metavar="D", help=what)
    what = "particles of each (default 30; with --groups 50)"
    parser.add_argument("--particles", type=int, metavar="P", help=what)
    what = f"numbers of lifts after which learners are compared (default {' '.join(map(str, _LIFTS))})"
    parser.add_argument("--lifts", type=int, nargs="+", metavar="N", help=what)
    what = "instead recover this many pairs of groups of people, formed from --repeats people of each condition"
    parser.add_argument("--groups", type=int, metavar="G", help=what)
    what = f"people in a group, at most --repeats (default {' '.join(map(str, _SIZES))})"
    parser.add_argument("--sizes", type=int, nargs="+", metavar="N", help=what)


def plan(arguments: argparse.Namespace) -> Work:
    """Checks the arguments, and plans the work."""
    most, is_grouped = 4 * linear.FAMILIAR + 5 * linear.MIXED, arguments.groups is not None
    other = ("--lifts", arguments.lifts) if is_grouped else ("--sizes", arguments.sizes)
    if other[1] is not None:
        raise BadValueError(other[0], "", f"has no effect {'with' if is_grouped else 'without'} --groups")
    draws, particles = (256, 50) if is_grouped else (16, 30)
    draws, particles = arguments.draws or draws, arguments.particles or particles
    lifts = tuple(sorted({*(arguments.lifts or _LIFTS)}))
    sizes = tuple(sorted({*(arguments.sizes or _SIZES)})) if is_grouped else ()
    for option, values, low, high in (
        ("--draws", [draws], 4, 1024),
        ("--particles", [particles], 1, 1000),
        ("--lifts", lifts, 2, most),
        ("--groups", [arguments.groups] if is_grouped else [], 1, 10_000),
        ("--sizes", sizes, 2, arguments.repeats),
    ):
        for value in values:
            if not low <= value <= high:
                nearest = min(max(value, low), high)
                raise BadValueError(option, "", f"is {value}, must be from {low} to {high}; the nearest is {nearest}")
    if is_grouped:
        of_groups = GroupRecovery(arguments.seed, draws, particles, arguments.repeats, sizes, arguments.groups)
        return partial(_work_on_groups, of_groups, arguments.jobs)
    return partial(_work, Recovery(arguments.seed, draws, particles, lifts), arguments.repeats, arguments.jobs)


def _work_on_groups(config: GroupRecovery, jobs: int, folder: Path) -> Iterator[Findings]:
    numbers = recover_groups(config, jobs, folder / "groups")
    print(
        f"{config.groups} pairs of groups of each size, from {config.people} people of each condition "
        f"({numbers['noisy_people']} of all with too much particle noise), in units of the logarithm"
    )
    header, *rows = list_rows(numbers)
    print(format_table(header, rows))
    yield Findings(numbers)


def _work(config: Recovery, repeats: int, jobs: int, folder: Path) -> Iterator[Findings]:
    names = [each.name for each in list_rivals()]
    found = run_kept(config, recover, folder, MODELS, repeats=repeats * len(names), jobs=jobs, description="recovery")
    numbers = summarise(config, names, found)
    for by in ("score", "bic"):
        for lifts, table in numbers[f"confusion_by_{by}"].items():
            print(f"Best by {by} after {lifts} lifts: rows are true learners, columns recovered ones")
            print(
                format_table(["", *names], [[name, *map(str, row)] for name, row in zip(names, table, strict=True)])
            )
    last = max(config.lifts)
    print(f"Lead of the true learner after {last} lifts: mean (SD between people), participants needed")
    rows = [[name, *(_show_lead(lead) for lead in numbers["leads"][last][name].values())] for name in names]
    print(format_table(["", *names], rows))
    for lifts, of in numbers["log_kappa"].items():
        shown = ", ".join(f"{key} {value:.3g}" for key, value in of.items())
        print(f"log kappa of a person after {lifts} lifts: {shown}")
    yield Findings(numbers)


def _show_lead(lead: Mapping[str, float]) -> str:
    shown = [f"{lead['mean']:.1f}"] if lead else []
    shown += [f" ({lead['sd']:.1f})"] if "sd" in lead else []
    shown += [f", {lead['people']}"] if "people" in lead else []
    return "".join(shown)


def summarise(config: Recovery, names: list[str], found: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Computes confusion matrices of learners and correlations between true and estimated kappa, for metrics.json."""
    true = np.arange(len(found["score"])) % len(names)
    numbers: dict[str, Any] = {"learners": names, "people_of_each": len(true) // len(names), "seed": config.seed}
    for by, sign in (("score", 1.0), ("bic", -1.0)):
        best = (sign * found[by]).argmax(axis=1)  # (participants, numbers of lifts)
        numbers[f"confusion_by_{by}"] = {
            lifts: [
                [int(((true == i) & (best[:, k] == j)).sum()) for j in range(len(names))] for i in range(len(names))
            ]
            for k, lifts in enumerate(config.lifts)
        }
    numbers["leads"] = {
        lifts: {
            name: {
                rival: compute_lead(found["score"][true == i, i, k] - found["score"][true == i, j, k])
                if i != j
                else {}
                for j, rival in enumerate(names)
            }
            for i, name in enumerate(names)
        }
        for k, lifts in enumerate(config.lifts)
    }
    has_kappa = np.isfinite(found["mean"][:, 0])
    log_kappa = found["log_kappa"][has_kappa]
    numbers["log_kappa"] = {}
    for k, lifts in enumerate(config.lifts):
        mean, sd = found["mean"][has_kappa, k], found["sd"][has_kappa, k]
        of = {"rms_error": float(np.sqrt(np.mean((mean - log_kappa) ** 2))), "posterior_sd": float(sd.mean())}
        if math.isfinite(people := count_per_group(of["posterior_sd"])):
            of["people_per_group"] = people
        if len(mean) > 2:
            of = {"correlation": float(np.corrcoef(mean, log_kappa)[0, 1]), **of}
        numbers["log_kappa"][lifts] = of
    return numbers


def compute_lead(leads: NDArray[np.float64]) -> dict[str, float]:
    """Computes mean and SD of leads in log score, (participants,), and the required number of participants.

    This number is for a one-sided t test at .05 with a power of .8 that the lead is positive. It is omitted if the
    mean is not positive or the number exceeds 10,000. The SD is omitted for a single participant.
    """
    found = {"mean": float(leads.mean())}
    if len(leads) > 1:
        found["sd"] = float(leads.std(ddof=1))
        effect = min(found["mean"] / max(found["sd"], 1e-12), 10.0)
        if math.isfinite(people := _count(effect, groups=1)):
            found["people"] = people
    return found


def _count(effect: float, *, groups: int) -> float:
    """Computes the required group size for a one-sided t test, infinite above 10,000."""
    for count in range(2, 10_001) if effect > 0.0 else ():
        free = groups * (count - 1)
        if 1.0 - nctdtr(free, effect * math.sqrt(count / groups), stdtrit(free, 1.0 - _ALPHA)) >= _POWER:
            return count
    return math.inf


def count_per_group(posterior_sd: float) -> float:
    """Computes the required group size for detecting a ratio of 1.5 between kappas of two groups.

    The test is one-sided at .05 with a power of .8. The SD of log kappa between participants is assumed to be .3.
    With posterior SD s and prior SD p, the error variance of log kappa is 1 / (1 / s^2 - 1 / p^2).
    """
    (kappa,) = list_free(KINDS_DRAWN, Participant(push_error=PUSH_ERROR), ["kappa"])
    information = posterior_sd**-2 - kappa.sd**-2
    if information <= 0.0:
        return math.inf
    return _count(math.log(1.5) / math.sqrt(_KAPPA_SPREAD**2 + 1.0 / information), groups=2)


STUDY = Study(
    "recover learners and kappa from the pushes of simulated people",
    add_arguments,
    plan,
)
