"""``affordance predict EXPERIMENT``: predicts what every learner would do before there are data."""

import argparse

from affordance.commands.options import add_learner, add_run_options, check_bounds, read_changes, read_robot
from affordance.commands.setups import check_experiment, check_learner, read_setup
from affordance.exceptions import BadValueError
from affordance.experiments.prediction import predict
from affordance.experiments.suite import NAMES, find_experiment
from affordance.reporting.learner_predictions import format_predictions
from affordance.robots.kept import open_robot
from affordance.runs.repeats import check_folder

# Most observers of each learner unless another number is asked for.
_OBSERVERS = 50


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    names = [name for name in NAMES if find_experiment(name).predict is not None]
    parser.add_argument("experiment", help=f"one of {', '.join(names)}")
    add_run_options(parser, None, f"simulated observers of each learner (default: at most {_OBSERVERS})", models="")
    add_learner(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, the spread of observers, and the best measurement."""
    check_experiment(arguments, NAMES)
    experiment = find_experiment(arguments.experiment)
    if (measure := experiment.predict) is None:
        problem = f"is {arguments.experiment!r}, whose observers are of one learner; run it with --learner for each"
        raise BadValueError("experiment", "", problem)
    if arguments.repeats is None:
        arguments.repeats = min(_OBSERVERS, experiment.observers)
    check_bounds(arguments)
    if arguments.repeats < 2:
        raise BadValueError("--repeats", "", f"is {arguments.repeats}, must be at least 2")
    changes = read_changes(arguments)
    check_learner("predict", changes)
    check_folder(arguments.out)
    robot = open_robot(*read_robot(arguments))
    setup = read_setup(arguments, robot, changes)
    experiment.read(setup)
    found = predict(arguments.experiment, setup, measure)
    print(format_predictions(found.meanings, found.predictions, found.contrasts, found.spreads))
    print(f"The predictions: {found.path}")
    return 0
