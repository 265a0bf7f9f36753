"""Checks and reads options that several commands share. ``arguments.py`` declares them."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from affordance.arguments import JOBS, REPEATS, check_whole
from affordance.belief.density_belief import Prior
from affordance.belief.learner import Learner
from affordance.belief.learner_file import load_learner
from affordance.commands.answers import tell
from affordance.commands.catalogue import LEARNER_NAMES, find_learner
from affordance.exceptions import AffordanceError, BadValueError, describe_choice
from affordance.files.constraints import SEEDS
from affordance.named_settings import change_settings, list_settings, parse_changes
from affordance.objects.materials import Material
from affordance.objects.tool import Tool
from affordance.settings import DEFAULT_SETTINGS, Settings

if TYPE_CHECKING:
    from affordance.experiments.shared.observers import Setup
    from affordance.robot import Robot

# Bounds of shared numbers. A larger value is impractical, and probably a typing error.
BOUNDS = {"repeats": REPEATS, "seed": SEEDS, "jobs": JOBS}


def open_robot(arguments: argparse.Namespace) -> "Robot":
    """Opens the robot of ``--robot``, which is a model folder or a robot's file. A file is imported once and cached.

    Raises:
        BadValueError: The path is neither a folder nor a file, the folder contains no arm, the file is invalid, or
            ``--tip`` is given without a file.
    """
    from affordance.robot import Robot  # imported here, because commands without a robot then start faster

    if arguments.robot is None and not arguments.tip:
        return Robot()
    # Imported here, because only a robot's file needs the importer.
    from affordance.extensions.robots import kept
    from affordance.extensions.robots.importer import ImportOptions

    root = (getattr(arguments, "out", None) or Path("results")) / "arms"
    return kept.open_robot(arguments.robot, ImportOptions(tip=arguments.tip or ""), root)


def remember(setup: "Setup", arguments: argparse.Namespace, robot: "Robot") -> "Setup":
    """Returns the setup of an observer that starts with the memory of ``--memory``."""
    # Imported here, because few observers have a lasting memory.
    from affordance.extensions.memory.ledger import count_of, describe_past_arms
    from affordance.extensions.memory.simulated_trial import remember_in

    if past := describe_past_arms(robot.name, count_of(robot, arguments.memory)):
        tell(arguments, past)
    return remember_in(setup, arguments.memory)


def read_learner(word: str) -> Learner:
    """Returns a learner by its name, or from a class in a Python file. The file is run.

    Raises:
        BadValueError: There is no such learner, file or class, running the file fails, or the class is not a learner.
    """
    return find_learner(word) or load_learner(word, LEARNER_NAMES)


def read_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Reads changes of settings by name, from ``--set`` and ``--learner``.

    Raises:
        BadValueError: A change is malformed or repeated, or the learner is unknown.
    """
    changes = parse_changes(arguments.changes)
    if word := getattr(arguments, "learner", None):
        if "learner" in changes:
            raise BadValueError("--set", "learner", "is given together with --learner, must be given once")
        changes["learner"] = read_learner(word)
    elif named := find_learner(str(changes.get("learner"))):
        changes["learner"] = named
    return changes


def check_bounds(arguments: argparse.Namespace) -> None:
    """Checks shared options, and sets the number of processes if it is missing.

    Raises:
        BadValueError: A shared number is out of bounds, or the model folder does not exist.
    """
    if getattr(arguments, "jobs", 1) is None:
        import joblib  # imported here, so that commands without this option start faster

        arguments.jobs = joblib.cpu_count()
    for name, bound in BOUNDS.items():
        value = getattr(arguments, name, None)
        if value is not None:
            check_whole(f"--{name}", value, bound)
    models = getattr(arguments, "models", None)
    if models is not None and not models.is_dir():
        raise BadValueError("--models", "", f"is {str(models)!r}, which is not a folder")


def change_by_name(arguments: argparse.Namespace, settings: Settings = DEFAULT_SETTINGS) -> Settings:
    """Applies the changes from ``read_changes`` to settings.

    Raises:
        BadValueError: A setting is unknown, or a value is invalid.
    """
    return change_settings(settings, read_changes(arguments))


def read_prior(arguments: argparse.Namespace, what: str) -> Prior:
    """Returns the prior with the changes of ``--set``.

    Raises:
        BadValueError: A change is about any other setting.
    """
    groups = dict.fromkeys(each.name.partition(".")[0] for each in list_settings())
    refuse_changes(arguments, [name for name in groups if name != "prior"], f"{what} uses only the prior's settings")
    return change_by_name(arguments).prior


def refuse_changes(arguments: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Rejects changes of given settings or groups in ``--set``.

    Raises:
        BadValueError: Such a setting is changed. The message gives the reason ``why``.
    """
    for name in parse_changes(arguments.changes):
        if any(name == each or name.startswith(f"{each}.") for each in names):
            raise BadValueError("--set", name, f"has no effect here: {why}")


def is_object_file(path: Path) -> bool:
    """Returns True if a file is the URDF of a single object rather than a tools file."""
    return path.suffix.lower() == ".urdf"


def read_tools(path: Path, materials: Mapping[str, Material]) -> tuple[tuple[Tool, ...], tuple[str, ...]]:
    """Loads the tools of a tools file, or of an object's URDF, and returns them with remarks about the file."""
    if is_object_file(path):
        # Imported here, because few files need it.
        from affordance.extensions.robots.object_file import read_object

        tool, remarks = read_object(path, materials)
        return (tool,), remarks
    from affordance.objects.load import load_tools  # imported here, so that other commands start faster

    return load_tools(path, materials), ()


def choose_tools(tools: Sequence[Tool], names: Sequence[str], path: Path) -> list[Tool]:
    """Selects tools by name. Without names, all tools are selected.

    Raises:
        AffordanceError: A name is unknown, or a selected tool has no grips.
    """
    known = {tool.name: tool for tool in tools}
    for name in names:
        if name not in known:
            raise BadValueError(path, "--only", describe_choice(name, list(known)))
    chosen = [known[name] for name in names] or list(tools)
    for tool in chosen:
        if not tool.grips:
            raise AffordanceError(f"{path}: {tool.name} has no grips, must have at least one")
    return chosen
