"""Setup of an experiment from the options of a command."""

import argparse
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from affordance.commands.options import read_same_colours
from affordance.exceptions import BadArgumentError, BadValueError, describe_choice
from affordance.experiments.lasting_memory import remember_in
from affordance.experiments.observers import Setup
from affordance.experiments.suite import COMPARISONS, NAMES, Experiment, find_experiment, read_module
from affordance.files.constraints import FileName, run_check
from affordance.named_settings import Changes, change_settings
from affordance.objects.materials import MATERIALS, load_materials
from affordance.robots.robot import Robot
from affordance.runs.program_errors import blame_program
from affordance.runs.program_file import load_program
from affordance.settings import Settings

# Folders of results that no table, and no experiment of a user, may write to.
_TAKEN = (*NAMES, *COMPARISONS, "arms", "frames")


@contextmanager
def open_experiment(arguments: argparse.Namespace, names: Collection[str]) -> Iterator[tuple[str, Experiment]]:
    """Finds an experiment by its name, or loads that of a Python file, and yields its name too.

    Mistakes of that file are then named with its line, until the experiment is done with.
    """
    path = Path(arguments.experiment)
    if path.suffix != ".py":
        check_experiment(arguments, names)
        yield path.name, find_experiment(path.name)
        return
    name = check_own_name(path)
    with blame_program(path):
        module = load_program(path, "experiment")
        if not callable(getattr(module, "run", None)):
            raise BadValueError(path, "run", "is missing, must be a function of a Setup that returns Results")
        yield name, read_module(module)


def check_experiment(arguments: argparse.Namespace, names: Collection[str]) -> None:
    """Raises a BadValueError for no such experiment; that of a former protocol says what has taken its place."""
    if Path(arguments.experiment).suffix in (".yaml", ".yml"):
        problem = f"is {arguments.experiment!r}: experiments are programs now, and protocols in YAML are gone"
        raise BadValueError("experiment", "", f"{problem} (CHANGELOG.md); known are {', '.join(names)}")
    if arguments.experiment not in names:
        raise BadValueError("experiment", "", describe_choice(arguments.experiment, names))


def read_setup(arguments: argparse.Namespace, robot: Robot, changes: Changes) -> Setup:
    """Reads the setup of an experiment from the options of ``add_run_options``, with changed settings by name.

    With ``--memory`` its one observer begins with a lasting memory.
    """
    setup = Setup(
        observers=arguments.repeats,
        seed=arguments.seed,
        jobs=arguments.jobs,
        models=robot.folder,
        out=arguments.out,
        settings=change_settings(Settings(arm=robot.directives), changes),
    )
    if not hasattr(arguments, "memory"):
        return setup
    materials = load_materials(robot.folder / MATERIALS.name) if arguments.same_colour else {}
    pairs = read_same_colours(arguments, materials)
    return remember_in(setup, arguments.memory, pairs) if arguments.memory else setup


def check_own_name(path: Path) -> str:
    """Returns the name of a file's results, its own without suffix; one that is taken, or no name, is refused."""
    try:
        run_check("", FileName().check, path.stem)
    except BadArgumentError as error:
        raise BadValueError(path, "", f"names the folder of its results, which {error.problem}") from error
    if path.stem in _TAKEN:
        problem = f"would write to the results of {path.stem}, must have another name, such as my_{path.name}"
        raise BadValueError(path, "", problem)
    return path.stem
