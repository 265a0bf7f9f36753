"""``affordance run``: the experiments, their numbers, figures and report."""

import argparse
import sys
from pathlib import Path

import joblib

from affordance.belief.learner import Learner
from affordance.commands.import_arm import add_arm_arguments, read_options
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.suite import EXPERIMENTS, STUDIES, run_suite
from affordance.files.model_folder import MODELS
from affordance.protocols.protocol import SUFFIXES, list_shipped
from affordance.robots.kept import import_kept
from affordance.vision.features import FeatureSource

HELP = "run the paper's simulations or a protocol of your own; write numbers, figures and report"
# Exit status where some of several experiments could not be done.
LEFT_OUT = 3
# Bounds of the numbers on the command line: more than anyone has patience or processors for is a slip of the finger.
_REPEATS, _STUDY_REPEATS = 200, 300
BOUNDS = {"repeats": (1, 1_000_000), "seed": (0, 2**32 - 1), "jobs": (1, 4096)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "experiment",
        nargs="?",
        default="all",
        help=f"{', '.join(EXPERIMENTS)}, all of these (default), {', '.join(STUDIES)}, or a protocol (path or name)",
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
        "--learner",
        choices=[learner.value for learner in Learner],
        default=Learner.DENSITY.value,
        help="one density for each colour (default; the paper's), or kinds within a colour, most probable or drawn",
    )
    parser.add_argument(
        "--fault", action="append", default=[], help="what is to be wrong, of the models' faults.yaml; more than once"
    )
    parser.add_argument(
        "--arm", type=Path, metavar="FILE", help="a robot's file whose arm to use, imported into a kept folder"
    )
    add_arm_arguments(parser)
    parser.add_argument("--cluster", metavar="ADDRESS", help="Dask scheduler to send repeats to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs what is asked for; returns the exit status, LEFT_OUT if some of it could not be done.

    Raises:
        AffordanceError: An argument or a file is wrong.
    """
    if arguments.repeats is None:
        arguments.repeats = _STUDY_REPEATS if arguments.experiment in STUDIES else _REPEATS
    experiments = check_arguments(arguments)
    report, left_out = run_suite(
        experiments,
        arguments.out,
        models=find_models(arguments),
        seed=arguments.seed,
        repeats=arguments.repeats,
        jobs=arguments.jobs,
        faults=arguments.fault,
        cluster=arguments.cluster,
        feature_source=FeatureSource(arguments.vision),
        learner=Learner(arguments.learner),
    )
    print(f"The report: {report}")
    if left_out:
        names = ", ".join(left_out)
        print(f"Left out, as the report says: {names}", file=sys.stderr)
        return LEFT_OUT
    return 0


def find_models(arguments: argparse.Namespace) -> Path:
    """The folder of models that was asked for, made of a robot's file if there is one.

    Raises:
        BadValueError: What is said of the arm is wrong, or does not go together.
        ModelFileError: The robot's file cannot be read.
    """
    if arguments.arm is None:
        if arguments.tip is not None:
            raise BadValueError("--tip", "", "is of a robot's file, which --arm must name")
        models: Path = arguments.models
        return models
    if arguments.models != MODELS:
        raise BadValueError("--arm", "", "makes a folder of models, so that --models cannot name another")
    kept = import_kept(arguments.arm, read_options(arguments), arguments.out / "arms")
    print(f"{arguments.arm.name}: models in {kept}")
    return kept


def check_arguments(arguments: argparse.Namespace) -> list[str]:
    """Returns the experiments to run.

    Raises:
        BadValueError: An argument is out of bounds.
    """
    check_bounds(arguments)
    if arguments.experiment == "all":
        return list(EXPERIMENTS)
    if arguments.experiment in STUDIES:
        return [arguments.experiment]
    if arguments.experiment not in EXPERIMENTS and Path(arguments.experiment).suffix not in SUFFIXES:
        known = (
            *EXPERIMENTS,
            *STUDIES,
            "all",
            *(name for name in list_shipped(arguments.models) if name not in EXPERIMENTS),
        )
        if arguments.experiment not in known:
            raise BadValueError("experiment", "", describe_choice(arguments.experiment, known))
    return [arguments.experiment]


def check_bounds(arguments: argparse.Namespace) -> None:
    """Checks the numbers that all commands share.

    Raises:
        BadValueError: An argument is out of bounds.
    """
    for name, (low, high) in BOUNDS.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise BadValueError(f"--{name}", "", f"is {value}, must be from {low} to {high}")
