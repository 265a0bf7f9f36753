"""``affordance study NAME``: studies beside the paper's simulations, a module ``study_NAME`` each."""

import argparse
import importlib
import pkgutil

import affordance.commands

HELP = "run a study beside the paper's simulations: people (their data beside ours), learners (with each learner)"
_PREFIX = "study_"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds a parser for every study there is."""
    studies = parser.add_subparsers(dest="study", required=True, metavar="NAME", parser_class=type(parser))
    for module in sorted(module.name for module in pkgutil.iter_modules(affordance.commands.__path__)):
        if module.startswith(_PREFIX):
            study = importlib.import_module(f"affordance.commands.{module}")
            name = module.removeprefix(_PREFIX).replace("_", "-")
            of_study = studies.add_parser(name, description=study.HELP, help=study.HELP)
            study.add_arguments(of_study)
            of_study.set_defaults(run=study.run)


def run(arguments: argparse.Namespace) -> int:
    """Runs the study.

    Raises:
        AffordanceError: An argument or a file is wrong.
    """
    status: int = arguments.run(arguments)
    return status
