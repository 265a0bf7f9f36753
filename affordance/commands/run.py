"""``affordance run``: the experiments, their numbers, figures and report."""

import argparse
from pathlib import Path

import joblib

from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.suite import EXPERIMENTS, STUDIES, run_suite
from affordance.files.model_folder import MODELS
from affordance.vision.features import FeatureSource

HELP = "run the paper's simulations and write their numbers, figures and report"
# Bounds of the numbers on the command line: more than anyone has patience or processors for is a slip of the finger.
_REPEATS, _STUDY_REPEATS = 200, 300
BOUNDS = {"repeats": (1, 1_000_000), "seed": (0, 2**32 - 1), "jobs": (1, 4096)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "experiment",
        nargs="?",
        default="all",
        help=f"{', '.join(EXPERIMENTS)}, all of these (default: all), or {', '.join(STUDIES)}",
    )
    parser.add_argument(
        "--repeats",
        type=int,
        help=f"simulated observers, for vision objects (default {_REPEATS}); for robustness settings (default "
        f"{_STUDY_REPEATS})",
    )
    parser.add_argument("--seed", type=int, default=0, help="root of every random draw (default 0)")
    parser.add_argument("--jobs", type=int, default=joblib.cpu_count(), help="processes (default: one a core)")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results (default results/)")
    parser.add_argument("--models", type=Path, default=MODELS, help="folder with arm, materials and tools to use")
    parser.add_argument(
        "--vision",
        choices=[source.value for source in FeatureSource],
        default=FeatureSource.FEATURES.value,
        help="true features of objects (default), or from a picture of each; vision always takes pictures",
    )
    parser.add_argument(
        "--fault", action="append", default=[], help="what is to be wrong, of the models' faults.yaml; more than once"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send repeats to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs what is asked for.

    Raises:
        AffordanceError: An argument or a file is wrong.
    """
    if arguments.repeats is None:
        arguments.repeats = _STUDY_REPEATS if arguments.experiment in STUDIES else _REPEATS
    report = run_suite(
        check_arguments(arguments),
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
    return 0


def check_arguments(arguments: argparse.Namespace) -> list[str]:
    """Returns the experiments to run.

    Raises:
        BadValueError: An argument is out of bounds.
    """
    if arguments.experiment not in (*EXPERIMENTS, *STUDIES, "all"):
        raise BadValueError("experiment", "", describe_choice(arguments.experiment, (*EXPERIMENTS, *STUDIES, "all")))
    for name, (low, high) in BOUNDS.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise BadValueError(f"--{name}", "", f"is {value}, must be from {low} to {high}")
    return list(EXPERIMENTS) if arguments.experiment == "all" else [arguments.experiment]
