"""Finds the experiment that a command names, and builds its setup from options."""

import argparse
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from affordance.belief.learners import LEARNERS
from affordance.commands.catalogue import EXPERIMENTS, find_experiment
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.files.constraints import FileName, run_check
from affordance.named_settings import Changes, change_settings
from affordance.robot import Robot
from affordance.runs.program_errors import blame_program
from affordance.runs.program_file import load_program
from affordance.settings import DEFAULT_SETTINGS, Settings

# Folders of results to which no user's table or experiment may write.
_TAKEN = (*EXPERIMENTS, "arms", "frames")


def check_experiment(arguments: argparse.Namespace, names: Collection[str], *, or_file: bool = False) -> None:
    """Checks that a word names an experiment or, if allowed, a Python file.

    Raises:
        BadValueError: There is no such experiment.
    """
    if arguments.experiment not in names and not (or_file and Path(arguments.experiment).suffix == ".py"):
        raise BadValueError("experiment", "", describe_choice(arguments.experiment, names))


@contextmanager
def open_experiment(word: str) -> Iterator[tuple[str, Experiment]]:
    """Finds an experiment by its name, or loads it from a user's Python file.

    As long as the context is open, errors in the file are reported with their line.

    Args:
        word: Name of an experiment, or path of a file that ends in .py.

    Yields:
        Name of the experiment, and the experiment.
    """
    path = Path(word)
    if path.suffix != ".py":
        yield word, find_experiment(word)
        return
    name = check_own_name(path)
    with blame_program(path):
        experiment = getattr(load_program(path, "experiment"), "EXPERIMENT", None)
        if not isinstance(experiment, Experiment):
            raise BadValueError(path, "EXPERIMENT", "is missing, must be an Experiment(run), last in the file")
        yield name, experiment


def check_own_name(path: Path) -> str:
    """Returns a file's name without suffix, which becomes the name of its results folder.

    Raises:
        BadValueError: The name is not valid for a folder, or is used by the program.
    """
    try:
        run_check("", FileName().check, path.stem)
    except BadArgumentError as error:
        raise BadValueError(path, "", f"names the folder of its results, which {error.problem}") from error
    if path.stem in _TAKEN:
        problem = f"would write to the results of {path.stem}, must have another name, such as my_{path.name}"
        raise BadValueError(path, "", problem)
    return path.stem


def check_learner(name: str, changes: Changes) -> None:
    """Checks that no built-in learner is selected for an experiment that compares all of them.

    Raises:
        BadValueError: A built-in learner is selected.
    """
    own = {each: value for each, value in changes.items() if each.partition(".")[0] == "learner"}
    if own and change_settings(DEFAULT_SETTINGS, own).learner in LEARNERS.values():
        problem = (
            f"has no effect on {name}, which always simulates {', '.join(LEARNERS)}; leave it out, or add your own"
        )
        raise BadValueError("--learner", "", problem)


def read_setup(
    arguments: argparse.Namespace, robot: Robot, changes: Changes, kind: type[Settings] = Settings
) -> Setup:
    """Builds the setup of an experiment from options and changed settings."""
    return Setup(
        observers=arguments.repeats,
        seed=arguments.seed,
        jobs=arguments.jobs,
        models=robot.folder,
        out=arguments.out,
        settings=change_settings(kind(arm=robot.directives), changes),
    )
