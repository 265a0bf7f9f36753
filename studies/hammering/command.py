"""``affordance study hammering``: studies the blows of Simulation IV beyond the choice of a grip."""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from affordance.commands.options import add_jobs, add_models, add_out, add_seed, add_set
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.experiments.shared.choice_task import ChoicePlan
from affordance.experiments.shared.choosing import ChoiceExperiment
from studies.hammering.blows import describe_blows, study_blows
from studies.study import Findings, Study, Work, read_settings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    for add in (add_seed, add_jobs, add_out, add_models, add_set):
        add(parser)


def plan(arguments: argparse.Namespace) -> Work:
    """Plans the blows of the experiment."""
    experiment = load_choice_experiment("hammer", arguments.models, arguments.seed, read_settings(arguments))
    return partial(_work, experiment, experiment.plan(arguments.jobs), arguments.jobs)


def _work(experiment: ChoiceExperiment, planned: ChoicePlan, jobs: int, folder: Path) -> Iterator[Findings]:
    yield describe_blows(study_blows(experiment, planned, jobs=jobs), experiment)


STUDY = Study(
    "forces at which the cheaper grip changes, blows on another nail, and swings by other criteria",
    add_arguments,
    plan,
    refused={("learner", "noise", "feature_source"): "blows are studied with what is true"},
)
