"""``affordance predict PROTOCOL``: what every learner would do, before there are data."""

import argparse
from pathlib import Path

import joblib

from affordance.commands.run import check_bounds
from affordance.exceptions import BadValueError
from affordance.experiments.people.prediction import contrast_learners, format_predictions, summarise
from affordance.experiments.prediction import predict_protocol
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM
from affordance.settings import Settings

HELP = "say before there are data what each learner would do in a protocol, and what would tell them apart best"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("protocol", help="path of a protocol, or the name of a shipped one")
    parser.add_argument("--repeats", type=int, default=50, help="simulated observers of each learner (default 50)")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, the spread of observers, and the best measurement.

    Raises:
        BadValueError: An option is out of bounds, or the protocol is wrong.
    """
    check_bounds(arguments)
    if arguments.repeats < 2:
        raise BadValueError("--repeats", "", f"is {arguments.repeats}, must be at least 2")
    values, meanings = predict_protocol(
        arguments.protocol,
        arguments.models,
        Settings(arm=arguments.models / ARM.name),
        repeats=arguments.repeats,
        seed=arguments.seed,
        jobs=arguments.jobs,
    )
    predictions = {
        name: {learner: summarise(of_observers) for learner, of_observers in by_learner.items()}
        for name, by_learner in values.items()
    }
    print(format_predictions(meanings, predictions, contrast_learners(predictions)))
    return 0
