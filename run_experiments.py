"""Runs the paper's simulations and writes their numbers, figures and report.

run_experiments.py [weight|com|reach|hammer|vision|all] [--repeats N] [--seed S] [--jobs J] [--out DIR]
                   [--models DIR] [--vision features|pixels] [--fault NAME] [--cluster ADDRESS]
"""

import argparse
import logging
import sys
from pathlib import Path
from typing import NoReturn

import joblib

from affordance.exceptions import AffordanceError, BadValueError
from affordance.experiments.suite import EXPERIMENTS, run_suite
from affordance.files.model_folder import MODELS
from affordance.vision.features import FeatureSource

# Bounds of the numbers on the command line: more than anyone has patience or processors for is a slip of the finger.
BOUNDS = {"repeats": (1, 1_000_000), "seed": (0, 2**32 - 1), "jobs": (1, 4096)}


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, without the usage in front."""

    def error(self, message: str) -> NoReturn:
        """Ends the program with exit status 2."""
        self.exit(2, f"{self.prog}: {message}\n")


def build_parser() -> argparse.ArgumentParser:
    """Builds the command line."""
    parser = OneLineParser(description="Run the simulations of visual inertial affordances.")
    parser.add_argument("experiment", nargs="?", default="all", help=f"{', '.join(EXPERIMENTS)} or all (default)")
    parser.add_argument(
        "--repeats", type=int, default=200, help="simulated observers; for vision, objects (default 200)"
    )
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")
    parser.add_argument(
        "--vision",
        choices=[feature_source.value for feature_source in FeatureSource],
        default=FeatureSource.FEATURES.value,
        help="features of objects as they are (default), or seen in a picture of each; vision always sees pictures",
    )
    parser.add_argument(
        "--fault", action="append", default=[], help="what is to be wrong, of the models' faults.yaml; more than once"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send repeats to, in place of --jobs")
    return parser


def check_arguments(arguments: argparse.Namespace) -> list[str]:
    """Returns the experiments to run.

    Raises:
        BadValueError: An argument is out of bounds.
    """
    if arguments.experiment not in (*EXPERIMENTS, "all"):
        known = ", ".join((*EXPERIMENTS, "all"))
        raise BadValueError("experiment", "", f"is {arguments.experiment!r}, must be one of {known}")
    for name, (low, high) in BOUNDS.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise BadValueError(f"--{name}", "", f"is {value}, must be from {low} to {high}")
    return list(EXPERIMENTS) if arguments.experiment == "all" else [arguments.experiment]


def main() -> int:
    """Runs what the command line asks for; returns the exit status."""
    arguments = build_parser().parse_args()
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat announces its port
    try:
        names = check_arguments(arguments)
        report = run_suite(
            names,
            arguments.out,
            models=arguments.models,
            seed=arguments.seed,
            repeats=arguments.repeats,
            jobs=arguments.jobs,
            faults=arguments.fault,
            cluster=arguments.cluster,
            feature_source=FeatureSource(arguments.vision),
        )
        print(f"The report: {report}")
    except AffordanceError as error:
        print(f"run_experiments.py: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("run_experiments.py: interrupted; the same command goes on where it was", file=sys.stderr)
        return 130
    except OSError as error:  # a full disk, a folder that was taken away
        print(f"run_experiments.py: {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
