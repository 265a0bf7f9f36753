"""Builds the setup of an experiment from the options of a command."""

import argparse
from collections.abc import Collection
from pathlib import Path

from affordance.belief.learners import LEARNERS
from affordance.commands.options import read_same_colours
from affordance.exceptions import BadValueError, describe_choice
from affordance.experiments.lasting_memory import remember_in
from affordance.experiments.observers import Setup
from affordance.named_settings import Changes, change_settings
from affordance.objects.materials import MATERIALS, load_materials
from affordance.robots.robot import Robot
from affordance.settings import DEFAULT_SETTINGS, Settings


def check_experiment(arguments: argparse.Namespace, names: Collection[str]) -> None:
    """Raises a BadValueError for an unknown experiment, unless it is a Python file.

    For a former YAML protocol, the message says what has replaced protocols.
    """
    if Path(arguments.experiment).suffix in (".yaml", ".yml"):
        problem = (
            f"is {arguments.experiment!r}: experiments are now Python programs, and YAML protocols are no longer read"
        )
        raise BadValueError("experiment", "", f"{problem} (CHANGELOG.md); must be one of {', '.join(names)}")
    if arguments.experiment not in names and Path(arguments.experiment).suffix != ".py":
        raise BadValueError("experiment", "", describe_choice(arguments.experiment, names))


def check_learner(name: str, changes: Changes) -> None:
    """Raises a BadValueError if one of our learners is chosen for an experiment that compares all of them."""
    own = {each: value for each, value in changes.items() if each.partition(".")[0] == "learner"}
    if own and change_settings(DEFAULT_SETTINGS, own).learner in LEARNERS.values():
        problem = f"has no effect on {name}, which always simulates {', '.join(LEARNERS)}; you can add your own"
        raise BadValueError("--learner", "", problem)


def read_setup(arguments: argparse.Namespace, robot: Robot, changes: Changes) -> Setup:
    """Builds an experiment's setup from the options of ``add_run_options`` and changes of settings by name.

    With ``--memory`` its only observer starts with a lasting memory.
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
