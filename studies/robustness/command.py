"""``affordance study robustness``: tests all claims for a random sample of assumptions."""

import argparse
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from affordance.arguments import check_whole
from affordance.commands.arguments import add_run_options
from affordance.exceptions import BadValueError
from affordance.experiments.shared.results import describe_faults, describe_setup
from affordance.files.constraints import Whole
from affordance.runs.repeats import compute_key
from studies.random_streams import StudyStream
from studies.robustness import page
from studies.robustness.evaluate import Outcome
from studies.robustness.report import describe
from studies.robustness.study import DEFAULT_NUM_SETTINGS, INTERPOLATION_BOUND, Robustness, load
from studies.study import Findings, Study, Task, Work, read_settings, run_kept

# Bounds on the number of settings and on the index of a setting, from the size of the sample.
_REPEATS, _SETTING = Whole(1, 8192), Whole(0, 8191)
# Name of the default setting.
_DEFAULT = "default"
# Settings of the simulations that the sample varies, and settings that the study does not use.
_VARIED = ("noise", "sample_period", "acceleration_sd", "prior", "mpc.horizon", "cost_measure")
_UNUSED = ("learner", "eye", "vision_error")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    what = "settings of the sample"
    add_run_options(parser, DEFAULT_NUM_SETTINGS, what, models="arm, materials, path and nail")
    alone = parser.add_mutually_exclusive_group()
    alone.add_argument(
        "--setting",
        metavar="N",
        help=f"evaluate only setting N, or '{_DEFAULT}' for that of the simulations, and print the results",
    )
    alone.add_argument(
        "--prove",
        type=int,
        metavar="N",
        help="compare interpolated holds with simulated holds of all observers, in N settings drawn at random",
    )
    alone.add_argument("--page", action="store_true", help="fill the tables of docs/robustness.md from results/")


def plan(arguments: argparse.Namespace) -> Work | Task:
    """Plans a full run, the evaluation of one setting, a test of interpolation, or an update of the page."""
    if arguments.page:
        return Task(page.fill)
    check_whole("--repeats", arguments.repeats, _REPEATS)
    study = load(arguments.models, arguments.seed, read_settings(arguments))
    if arguments.setting is not None:
        return Task(partial(_show_setting, study, _read_setting(arguments.setting)))
    if arguments.prove is not None:
        return Task(partial(_prove, study, check_whole("--prove", arguments.prove, _REPEATS)))
    return partial(_work, study, arguments)


def _work(study: Robustness, arguments: argparse.Namespace, folder: Path) -> Iterator[Findings]:
    """Evaluates the default setting, and then the sampled settings."""
    start = time.perf_counter()
    arrays = run_kept(
        study,
        Robustness.run_setting,
        folder,
        study.list_files(),
        repeats=arguments.repeats + 1,
        jobs=arguments.jobs,
        description="robustness",
    )
    numbers = study.compute_metrics(arrays)
    run = {
        "seed": study.seed,
        "repeats": arguments.repeats,
        "config": study,
        "setup": describe_setup(study.settings),
        "inputs": compute_key(None, study.settings.arm.parent),
        "wall_s": time.perf_counter() - start,
    }
    section = describe(numbers, describe_faults(study.settings.faults))
    figures = {"robustness": partial(study.draw, numbers)}
    yield Findings({**numbers, **run}, section, figures, writers=(partial(study.write_settings, arrays),))


def _read_setting(text: str) -> int | None:
    """Parses the index of a setting, or returns None for the default setting."""
    if text == _DEFAULT:
        return None
    if not text.isdecimal():
        raise BadValueError("--setting", "", f"is {text!r}, must be a whole number or {_DEFAULT!r}")
    return check_whole("--setting", int(text), _SETTING)


def _show_setting(study: Robustness, index: int | None) -> int:
    setting, outcome = study.evaluate(index)
    labels = {each.name: each.label for each in study.assumptions}
    print("\n".join(describe_outcome({labels[name]: value for name, value in setting.items()}, outcome)))
    return 0


def _prove(study: Robustness, count: int) -> int:
    """Prints the error of interpolated trajectories, and returns exit status 1 if it is too large."""
    rng = np.random.default_rng([study.seed, StudyStream.PROOF])
    drawn = rng.choice(max(count, DEFAULT_NUM_SETTINGS), size=count, replace=False)
    worst = 0.0
    for index in (None, *(int(each) for each in np.sort(drawn))):
        _, outcome = study.evaluate(index, proves=True)
        name = _DEFAULT if index is None else str(index)
        print(f"setting {name}: largest error {1e6 * outcome.interpolation_error:.2f} um", flush=True)
        worst = max(worst, outcome.interpolation_error)
    met = worst <= INTERPOLATION_BOUND
    print(f"Largest error {1e6 * worst:.2f} um, {'within' if met else 'ABOVE'} {1e6 * INTERPOLATION_BOUND:.0f} um")
    return 0 if met else 1


def describe_outcome(setting: dict[str, float | str], outcome: Outcome) -> list[str]:
    """Formats assumptions, results, and valid claims of a setting."""
    lines = ["Assumes"]
    lines += [f"  {name}: {value if isinstance(value, str) else f'{value:.4g}'}" for name, value in setting.items()]
    lines.append("Gives")
    for experiment, numbers in outcome.numbers.items():
        lines += [f"  {experiment}.{name} = {_show(value)}" for name, value in numbers.items() if value is not None]
    lines += [f"  {name} was not run: {reason}" for name, reason in outcome.reasons.items() if reason]
    lines.append("Claims")
    words = {1.0: "holds", 0.0: "FAILS"}
    lines += [f"  {name}: {words.get(value, 'not judged')}" for name, value in outcome.outcomes.items()]
    held = [value == 1.0 for value in outcome.outcomes.values()]
    return [*lines, f"{sum(held)} of {len(held)} claims hold"]


def _show(value: Any) -> str:
    if isinstance(value, str | bool | dict):
        return str(value)
    return np.array2string(np.asarray(value), precision=4, separator=", ").replace("\n", "")


STUDY = Study(
    "judge every claim in a sample of all values that the paper does not give",
    add_arguments,
    plan,
    refused={
        _VARIED: "the sample varies it",
        _UNUSED: "observers see true features and learn one density for each colour",
    },
)
