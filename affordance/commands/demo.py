"""Demonstrations of commands on simulated data in the package."""

import argparse
import shlex
from collections.abc import Mapping, Sequence

from affordance.commands.answers import tell
from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS

_FOLDER = MODELS / "demo"
# Simulated recordings of the paper's arm, with an empty hand and with one piece of stock.
EMPTY, LOADED = _FOLDER / "empty.csv", _FOLDER / "bar_of_oak.csv"
# Recordings of the same arm with an empty hand in three other motions, 15 s each.
EMPTIES = [_FOLDER / f"empty_{k}.csv" for k in (1, 2, 3)]
ARM_FILE = MODELS / "arm.dmd.yaml"
STOCK, PIECE = MODELS / "workshop" / "blanks.yaml", "bar of oak"
# True mass of the piece in that simulation, [kg].
MASS = 0.550
# Trials from the memory of a learner that was given recordings of all pieces of stock.
TRIALS = _FOLDER / "trials.jsonl"
# Longest command on one line, [characters], and separator of the options in longer commands.
_WIDTH, _BREAK = 76, " \\\n      --"


def check_alone(arguments: argparse.Namespace, names: Mapping[str, str]) -> None:
    """Rejects arguments that a demonstration sets itself.

    Args:
        arguments: Parsed arguments.
        names: Names of attributes that must be empty, each with its name in the message.

    Raises:
        BadValueError: One of the attributes is not empty.
    """
    for name, shown in names.items():
        if getattr(arguments, name):
            raise BadValueError("--demo", "", f"uses its own data, must be given without {shown}")


def announce(arguments: argparse.Namespace, *commands: Sequence[object]) -> None:
    """Prints the commands that a demonstration runs; a long command has each option on its own line."""
    lines = ["Demonstration on simulated recordings from the package. It runs"]
    joined = [shlex.join(map(str, ("affordance", *command))) for command in commands]
    lines += [f"    {command if len(command) <= _WIDTH else command.replace(' --', _BREAK)}" for command in joined]
    tell(arguments, "\n".join([*lines, ""]))


def fill_in_recording(arguments: argparse.Namespace, flange: str) -> None:
    """Sets the arguments of ``identify`` for the package's recording, and prints the command.

    Args:
        arguments: Parsed arguments, which are changed.
        flange: Frame of the arm that is used as a controller's flange, unless the user names another frame.
    """
    names = ("loaded", "empty", "object", "description", "tip")
    check_alone(arguments, {"robot": "a robot", "robot_option": "--robot"} | {each: f"--{each}" for each in names})
    arguments.flange = arguments.flange or flange
    words = [ARM_FILE, "--empty", EMPTY, "--loaded", LOADED, "--object", STOCK, "--object-name", PIECE]
    announce(arguments, ["identify", *words, "--size-error", 0.02, "--unseen", 0.02, "--flange", arguments.flange])
    arguments.demo, arguments.robot, arguments.loaded, arguments.empty = False, ARM_FILE, LOADED, [EMPTY]
    arguments.object, arguments.object_name = STOCK, PIECE
    arguments.size_error = arguments.unseen = 0.02
