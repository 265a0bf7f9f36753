"""``affordance predict PROTOCOL``: what every learner would do, before there are data."""

import argparse
from pathlib import Path

import joblib

from affordance.commands.run import check_bounds
from affordance.exceptions import BadValueError
from affordance.experiments.people.prediction import format_predictions
from affordance.experiments.prediction import predict_protocol
from affordance.files.model_folder import MODELS
from affordance.plant.arm import ARM
from affordance.protocols.protocol import find_number_of_observers
from affordance.runs.repeats import check_folder
from affordance.settings import Settings

# Observers of a protocol that does not say how many.
_REPEATS = 50

HELP = "say before there are data what each learner would do in a protocol, and what would tell them apart best"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("protocol", help="path of a protocol, or the name of a shipped one")
    parser.add_argument(
        "--repeats",
        type=int,
        help=f"simulated observers of each learner (default: as many as a protocol says, or {_REPEATS})",
    )
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("results"),
        help="folder for what is predicted (default results/); a run there simulates no observer again",
    )
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, the spread of observers, and the best measurement.

    Raises:
        BadValueError: An option is out of bounds, or the protocol is wrong.
    """
    if arguments.repeats is None:
        arguments.repeats = find_number_of_observers(arguments.protocol, arguments.models) or _REPEATS
    check_bounds(arguments)
    if arguments.repeats < 2:
        raise BadValueError("--repeats", "", f"is {arguments.repeats}, must be at least 2")
    check_folder(arguments.out)
    found = predict_protocol(
        arguments.protocol,
        arguments.models,
        Settings(arm=arguments.models / ARM.name),
        arguments.out,
        repeats=arguments.repeats,
        seed=arguments.seed,
        jobs=arguments.jobs,
    )
    print(format_predictions(found.meanings, found.predictions, found.contrasts, found.spreads))
    print(f"The predictions: {found.path}")
    return 0
