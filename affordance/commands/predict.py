"""``affordance predict PROTOCOL``: predicts the behaviour of every learner before there are data."""

import argparse

from affordance.commands.options import add_run_options, check_bounds, find_shipped, read_robot
from affordance.exceptions import BadValueError
from affordance.experiments.prediction import predict_protocol
from affordance.experiments.suite import load_experiment
from affordance.named_settings import parse_changes
from affordance.protocols.protocol import find_number_of_observers, list_shipped
from affordance.reporting.learner_predictions import format_predictions
from affordance.robots.kept import open_robot
from affordance.runs.repeats import check_folder
from affordance.settings import Settings

# Observers for a protocol that gives no number.
_REPEATS = 50


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("protocol", help=f"path of a protocol, or one of {', '.join(list_shipped())}")
    what = f"simulated observers of each learner (default: as many as a protocol says, or {_REPEATS})"
    add_run_options(parser, None, what, models="")


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, the spread of observers, and the best measurement."""
    number = find_number_of_observers(arguments.protocol, find_shipped(arguments))
    if arguments.repeats is None:
        arguments.repeats = number or _REPEATS
    check_bounds(arguments)
    if arguments.repeats < 2:
        raise BadValueError("--repeats", "", f"is {arguments.repeats}, must be at least 2")
    check_folder(arguments.out)
    robot = open_robot(*read_robot(arguments))
    settings, changes = Settings(arm=robot.directives), parse_changes(arguments.changes)
    experiment = load_experiment(arguments.protocol, robot.folder, arguments.seed, settings, changes)
    found = predict_protocol(experiment, arguments.out, repeats=arguments.repeats, jobs=arguments.jobs)
    print(format_predictions(found.meanings, found.predictions, found.contrasts, found.spreads))
    print(f"The predictions: {found.path}")
    return 0
