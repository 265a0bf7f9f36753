"""``affordance study vision``: measures the accuracy of features from pictures, as ``affordance run vision`` does."""

import argparse

from affordance.commands.options import add_run_options
from affordance.experiments.suite import DEFAULT_REPEATS
from studies.study import Study, Task, plan_experiment, read_settings
from studies.vision.experiment import load


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_run_options(parser, DEFAULT_REPEATS, "random objects")
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send objects to, in place of --jobs")


def plan(arguments: argparse.Namespace) -> Task:
    """Reads the objects that are ranked, and plans the run."""
    return plan_experiment(load(arguments.models, arguments.seed, read_settings(arguments)), arguments)


STUDY = Study("how accurate features from pictures are, over random objects", add_arguments, plan, load=load)
