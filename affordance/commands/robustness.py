"""``affordance robustness``: every claim over a sample of everything that the paper does not give."""

import argparse
from pathlib import Path
from typing import Any

import joblib
import numpy as np

from affordance.exceptions import BadValueError
from affordance.experiments.robustness.evaluate import Outcome
from affordance.experiments.robustness.experiment import DEFAULT_NUM_SETTINGS, load
from affordance.experiments.suite import run_suite
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM
from affordance.settings import Settings

HELP = "judge every claim over a sample of all that the paper does not give"
_BOUNDS = {"settings": (1, 8192), "seed": (0, 2**32 - 1), "jobs": (1, 4096)}
_LAST_SETTING = 8191


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "--settings", type=int, default=DEFAULT_NUM_SETTINGS, help=f"settings (default {DEFAULT_NUM_SETTINGS})"
    )
    parser.add_argument("--setting", type=int, metavar="N", help="evaluate setting N alone, and print what it gives")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials, path and nail")
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send settings to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs the study, or one of its settings.

    Raises:
        AffordanceError: An argument or a file is wrong.
    """
    for name, (low, high) in _BOUNDS.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise BadValueError(f"--{name}", "", f"is {value}, must be from {low} to {high}")
    if arguments.setting is not None:
        if not 0 <= arguments.setting <= _LAST_SETTING:
            raise BadValueError("--setting", "", f"is {arguments.setting}, must be from 0 to {_LAST_SETTING}")
        experiment = load(arguments.models, arguments.seed, Settings(arm=arguments.models / ARM.name))
        setting, outcome = experiment.evaluate(arguments.setting)
        labels = {each.name: each.label for each in experiment.assumptions}
        print("\n".join(describe_outcome({labels[name]: value for name, value in setting.items()}, outcome)))
        return 0
    report, _ = run_suite(
        ["robustness"],
        arguments.out,
        models=arguments.models,
        seed=arguments.seed,
        repeats=arguments.settings,
        jobs=arguments.jobs,
        cluster=arguments.cluster,
    )
    print(f"The report: {report}")
    return 0


def describe_outcome(setting: dict[str, float | str], outcome: Outcome) -> list[str]:
    """Lines that say what a setting assumes, what it gives, and which claims hold in it."""
    lines = ["Assumes"]
    lines += [f"  {name}: {value if isinstance(value, str) else f'{value:.4g}'}" for name, value in setting.items()]
    lines.append("Gives")
    for experiment, numbers in outcome.numbers.items():
        lines += [f"  {experiment}.{name} = {_show(value)}" for name, value in numbers.items() if value is not None]
    lines += [f"  {name} was not run: {reason}" for name, reason in outcome.reasons.items() if reason]
    lines.append("Claims")
    words = {1.0: "holds", 0.0: "FAILS"}
    lines += [f"  {name}: {words.get(value, 'not judged')}" for name, value in outcome.outcomes.items()]
    return lines


def _show(value: Any) -> str:
    if isinstance(value, str | bool | dict):
        return str(value)
    return np.array2string(np.asarray(value), precision=4, separator=", ").replace("\n", "")
