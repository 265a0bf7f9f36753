"""Demonstrations of commands, on simulated data that come with the package."""

import argparse
import shlex
from collections.abc import Mapping, Sequence

from affordance.commands.options import tell
from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS

_FOLDER = MODELS / "demo"
# Recordings of one piece of stock, held by the paper's arm in simulation (studies/loop/record.py).
EMPTY, LOADED = _FOLDER / "empty.csv", _FOLDER / "bar_of_oak.csv"
ARM_FILE = MODELS / "arm.dmd.yaml"
STOCK, PIECE = MODELS / "workshop" / "blanks.yaml", "bar of oak"
# True mass of the piece in that simulation, [kg].
MASS = 0.550
# Trials that a memory exported after recordings of all pieces of stock.
TRIALS = _FOLDER / "trials.jsonl"


def check_alone(arguments: argparse.Namespace, names: Mapping[str, str]) -> None:
    """Raises a BadValueError for an argument that a demonstration sets itself; the values are the names shown."""
    for name, shown in names.items():
        if getattr(arguments, name):
            raise BadValueError("--demo", "", f"uses its own data, must be given without {shown}")


def announce(arguments: argparse.Namespace, *commands: Sequence[object]) -> None:
    """Prints the commands that a demonstration runs."""
    lines = ["Demonstration on simulated recordings that come with the package. It runs"]
    lines += [f"    {shlex.join(map(str, ('affordance', *command)))}" for command in commands]
    tell(arguments, "\n".join([*lines, ""]))
