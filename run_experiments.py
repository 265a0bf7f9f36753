"""Runs the paper's simulations and writes their numbers, figures and report.

run_experiments.py [weight|all] [--repeats N] [--seed S] [--jobs J] [--out DIR] [--models DIR]
"""

import argparse
import logging
import sys
from pathlib import Path
from typing import NoReturn

import joblib

from affordance.exceptions import AffordanceError, BadValueError
from affordance.experiments import weight
from affordance.report import write_report
from affordance.results import prepare_folder, remove_leftovers
from affordance.tools import MODELS

EXPERIMENTS = {weight.NAME: weight}


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, without the usage in front."""

    def error(self, message: str) -> NoReturn:
        """Ends the program with exit status 2."""
        self.exit(2, f"{self.prog}: {message}\n")


def build_parser() -> argparse.ArgumentParser:
    """Builds the command line."""
    parser = OneLineParser(description="Run the simulations of visual inertial affordances.")
    parser.add_argument("experiment", nargs="?", default="all", help=f"{', '.join(EXPERIMENTS)} or all (default)")
    parser.add_argument("--repeats", type=int, default=200, help="simulated observers (default 200)")
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")
    return parser


def check_arguments(arguments: argparse.Namespace) -> list[str]:
    """Returns the experiments to run.

    Raises:
        BadValueError: An argument is out of bounds.
    """
    if arguments.experiment not in (*EXPERIMENTS, "all"):
        known = ", ".join((*EXPERIMENTS, "all"))
        raise BadValueError("experiment", "", f"is {arguments.experiment!r}, must be one of {known}")
    for name, bound in (("repeats", 1), ("seed", 0), ("jobs", 1)):
        value = getattr(arguments, name)
        if value < bound:
            raise BadValueError(f"--{name}", "", f"is {value}, must be at least {bound}")
    return list(EXPERIMENTS) if arguments.experiment == "all" else [arguments.experiment]


def main() -> int:
    """Runs what the command line asks for; returns the exit status."""
    arguments = build_parser().parse_args()
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
    try:
        names = check_arguments(arguments)
        configs = {name: EXPERIMENTS[name].load_config(arguments.models, arguments.seed) for name in names}
        folders = {name: prepare_folder(arguments.out / name) for name in names}
        for name, folder in folders.items():
            EXPERIMENTS[name].run(configs[name], folder, repeats=arguments.repeats, jobs=arguments.jobs)
            remove_leftovers(folder)
        print(f"The report: {write_report(arguments.out)}")
    except AffordanceError as error:
        print(f"run_experiments.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
