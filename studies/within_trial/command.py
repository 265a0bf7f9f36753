"""``affordance study within_trial``: follows the belief and the arm within the first trial of Simulation I."""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from affordance.commands.options import add_models, add_out, add_seed, add_set
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.presented import PresentationExperiment
from studies.study import Findings, Study, Work, read_settings
from studies.within_trial.study import WHITE, WithinTrialStudy

# Index of the observer.
_OBSERVER = 0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    for add in (add_seed, add_out, add_models, add_set):
        add(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Reads the first object of Simulation I."""
    weight = load_hold_experiment("weight", arguments.models, arguments.seed, read_settings(arguments))
    return partial(_work, weight)


def _work(weight: PresentationExperiment, folder: Path) -> Iterator[Findings]:
    tool, seed = weight.tools[0], (weight.seed, _OBSERVER, 0)
    study = WithinTrialStudy(weight.settings, tool, duration=weight.duration, seed=seed)
    facts = {"name": tool.name, "white_sd": WHITE.sd, "run_shown": _OBSERVER}
    figures = {"posterior": study.draw_growth, "sinking": study.draw_sinking}
    yield Findings({**study.summarise(), "seed": weight.seed}, facts, figures)


STUDY = Study("the belief as it narrows within a trial, and an arm that already uses it", add_arguments, plan)
