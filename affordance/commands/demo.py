"""Demonstrations of commands: simulated data that come with the package, and the words that they stand for."""

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence

from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS

_FOLDER = MODELS / "demo"
# Recordings of one piece of stock, held by the paper's arm in simulation (studies/loop/record.py).
EMPTY, LOADED = _FOLDER / "empty.csv", _FOLDER / "bar_of_oak.csv"
ARM_FILE = MODELS / "arm.dmd.yaml"
STOCK, PIECE = MODELS / "workshop" / "blanks.yaml", "bar of oak"
# What the piece weighs in that simulation, [kg].
MASS = 0.550
# What recordings of all pieces of stock taught, as a memory exports it.
TRIALS = _FOLDER / "trials.jsonl"


def check_alone(arguments: argparse.Namespace, names: Mapping[str, str]) -> None:
    """Raises a BadValueError for an argument that a demonstration brings; names are shown by argument."""
    for name, shown in names.items():
        if getattr(arguments, name):
            raise BadValueError("--demo", "", f"brings its own data, must be given without {shown}")


def announce(*commands: Sequence[object], quietly: bool = False) -> None:
    """Prints the commands that a demonstration stands for, to standard error if the output is for a program."""
    lines = ["A demonstration, on simulated recordings that come with the package. It stands for"]
    lines += [f"    {shlex.join(map(str, ('affordance', *command)))}" for command in commands]
    print("\n".join(lines), end="\n\n", file=sys.stderr if quietly else sys.stdout)
