"""``affordance predict PROTOCOL``: what every learner would do, before there are data."""

import argparse

from affordance.commands.options import add_jobs, add_models, add_repeats, add_seed, add_set, check_bounds
from affordance.exceptions import BadValueError
from affordance.experiments.people.prediction import contrast_learners, format_predictions, summarise
from affordance.experiments.prediction import predict_protocol
from affordance.named_settings import parse_changes
from affordance.plant.arm import ARM
from affordance.settings import Settings

HELP = "say before there are data what each learner would do in a protocol, and what would tell them apart best"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("protocol", help="path of a protocol, or the name of a shipped one")
    add_repeats(parser, 50, "simulated observers of each learner")
    add_seed(parser)
    add_jobs(parser)
    add_models(parser)
    add_set(parser)


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
        changes=parse_changes(arguments.changes),
    )
    predictions = {
        name: {learner: summarise(of_observers) for learner, of_observers in by_learner.items()}
        for name, by_learner in values.items()
    }
    print(format_predictions(meanings, predictions, contrast_learners(predictions)))
    return 0
