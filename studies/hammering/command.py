"""``affordance study hammering``: studies the blows of Simulation IV beyond the choice of a grip."""

import argparse
from pathlib import Path

from affordance.commands.options import (
    add_jobs,
    add_models,
    add_out,
    add_seed,
    add_set,
    change_by_name,
    check_bounds,
    refuse_changes,
)
from affordance.experiments.protocol_runs import load_choice_experiment
from affordance.plant.arm import ARM
from affordance.runs.repeats import prepare_folder
from affordance.settings import Settings
from studies.hammering.blows import describe_blows, study_blows
from studies.study import write_findings

HELP = "forces at which the cheaper grip changes, blows on another nail, and swings by other criteria"
NAME = "hammering"
SECTION = Path(__file__).with_name("section.yaml")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_seed(parser)
    add_jobs(parser)
    add_out(parser)
    add_models(parser)
    add_set(parser)


def run(arguments: argparse.Namespace) -> int:
    """Runs the study.

    Raises:
        AffordanceError: An argument or a file is invalid, or the demanded blow cannot be dealt.
    """
    check_bounds(arguments)
    refuse_changes(arguments, ["learner", "noise", "feature_source"], "blows are studied with what is true")
    settings = change_by_name(arguments, Settings(arm=arguments.models / ARM.name))
    experiment = load_choice_experiment("hammer", arguments.models, arguments.seed, settings)
    plan = experiment.plan(arguments.jobs)
    folder = prepare_folder(arguments.out) / NAME
    study = study_blows(experiment, plan, jobs=arguments.jobs)
    print(f"The report: {write_findings(describe_blows(study, experiment), folder, SECTION)}")
    return 0
