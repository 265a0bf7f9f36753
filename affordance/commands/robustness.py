"""``affordance robustness``: evaluates every claim over a sample of all values that the paper does not give."""

import argparse
from typing import Any

import numpy as np

from affordance.arguments import check_whole
from affordance.commands.options import (
    add_jobs,
    add_models,
    add_out,
    add_repeats,
    add_seed,
    add_set,
    change_by_name,
    check_bounds,
    refuse_changes,
)
from affordance.experiments.robustness.evaluate import Outcome
from affordance.experiments.robustness.experiment import DEFAULT_NUM_SETTINGS, load
from affordance.experiments.suite import run_suite
from affordance.files.data_model import Whole
from affordance.named_settings import parse_changes
from affordance.plant.arm import ARM
from affordance.settings import Settings

HELP = "judge every claim over a sample of all that the paper does not give"
# Bounds of number and index of settings, from the size of the sample.
_REPEATS, _SETTING = Whole(1, 8192), Whole(0, 8191)
# Settings that the sample varies, and settings that the study does not use.
_VARIED = ("noise", "sample_period", "acceleration_sd", "prior", "mpc.horizon", "cost_measure")
_UNUSED = ("learner", "feature_source", "vision_error")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_repeats(parser, DEFAULT_NUM_SETTINGS, "settings of the sample", former=["--settings"])
    parser.add_argument("--setting", type=int, metavar="N", help="evaluate setting N alone, and print what it gives")
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)
    add_models(parser, "arm, materials, path and nail")
    add_set(parser)
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send settings to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs the study, or one of its settings.

    Raises:
        AffordanceError: An argument or a file is invalid.
    """
    check_bounds(arguments)
    check_whole("--repeats", arguments.repeats, _REPEATS)
    refuse_changes(arguments, _VARIED, "the sample varies it")
    refuse_changes(arguments, _UNUSED, "observers see true features and learn one density for each colour")
    if arguments.setting is not None:
        check_whole("--setting", arguments.setting, _SETTING)
        settings = change_by_name(arguments, Settings(arm=arguments.models / ARM.name))
        experiment = load(arguments.models, arguments.seed, settings)
        setting, outcome = experiment.evaluate(arguments.setting)
        labels = {each.name: each.label for each in experiment.assumptions}
        print("\n".join(describe_outcome({labels[name]: value for name, value in setting.items()}, outcome)))
        return 0
    report, _ = run_suite(
        ["robustness"],
        arguments.out,
        models=arguments.models,
        seed=arguments.seed,
        repeats=arguments.repeats,
        jobs=arguments.jobs,
        cluster=arguments.cluster,
        changes=parse_changes(arguments.changes),
    )
    print(f"The report: {report}")
    return 0


def describe_outcome(setting: dict[str, float | str], outcome: Outcome) -> list[str]:
    """Formats the assumptions of a setting, its results, and the claims that hold in it."""
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
