"""Help and examples of all commands, grouped by subject."""

import argparse
import importlib
from typing import Protocol, cast

# One line of help per command, grouped by subject. They are kept here so that --help imports no command. A dash in a
# command's name is an underscore in the name of its module.
SUBJECTS = {
    "Simulated people and robots": {
        "run": "run the paper's simulations or other experiments; write numbers, figures and a report",
        "watch": "watch an observer in an experiment, live in the browser",
        "film": "write a film of an experiment: the arm with each object, side by side",
        "predict": "predict what each learner would do in an experiment, and which number separates them best",
        "lift": "simulate the trials of a table: observers lift, hold or look at objects",
        "fit": "fit a learner to the pushes of people, person by person or pooled",
        "compare-learners": "find the learner that predicts each person's lifts best, one trial ahead",
        "new-experiment": "write a runnable example experiment in Python, for you to change",
    },
    "Choice of tools": {
        "guess": "estimate mass, centre of mass and inertia of objects from how they look, before they are held",
        "rank": "rank tools and grips for a task, from drawings or pictures, and give the reasons",
        "next": "advise which object to hold next before a tool is chosen, and when to stop",
        "new-tools": "write a commented tools file to fill in, for rank and next",
    },
    "Robots and recordings": {
        "import-arm": "make a model folder for the arm in a robot's file (URDF, SDF or MJCF)",
        "compare-robots": "compare two files of one robot, joint by joint: mass, centre of mass, inertia, limits",
        "excite": "design a motion from which mass, centre of mass, inertia or the cost of a task can be identified",
        "identify": "identify a payload from recordings: mass, centre of mass and inertia, with intervals",
        "memory": "show, edit or verify a lasting memory of the objects that robots have held",
    },
    "Program": {
        "settings": "list the settings that --set changes, with value, unit and source",
        "study": "run a long study (minutes to hours): affordance study NAME; without NAME, list all",
        "tutorials": "copy the tutorials to a folder, as notebooks if jupytext is installed, and open Jupyter",
        "doctor": "check which parts work on this machine, and say how to install the others",
        "completion": "print a script that completes commands and options in a shell",
    },
}
COMMANDS = {name: text for group in SUBJECTS.values() for name, text in group.items()}
# Arguments of the example with which a command's help ends.
EXAMPLES = {
    "run": "weight --repeats 20",
    "watch": "com",
    "film": "weight out.gif",
    "predict": "weight --repeats 20",
    "lift": "--trials trials.csv --objects objects.yaml",
    "fit": "lifts.csv --learner kinds_drawn",
    "compare-learners": "lifts.csv",
    "new-experiment": "my_experiment",
    "guess": "tools.yaml",
    "rank": "hammer --demo",
    "next": "hammer reach",
    "new-tools": "my_tools.yaml",
    "import-arm": "robot.urdf --out my_arm",
    "compare-robots": "old.urdf new.urdf",
    "excite": "--for com",
    "identify": "--demo",
    "memory": "show robot.sqlite",
    "settings": "prior noise",
    "study": "people",
    "tutorials": "--copy-only",
    "completion": "bash",
}
# Experiments that can be called without ``run``, as in ``affordance weight``.
EXPERIMENTS = ("all", "weight", "com", "reach", "hammer", "vision")


class Command(Protocol):
    """Interface of a command's module."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Adds the command's arguments to a parser."""

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the command and returns its exit status.

        Raises:
            AffordanceError: If the input is invalid; its message is one line.
        """


def load_command(name: str) -> Command:
    """Imports the module of a command."""
    module: object = importlib.import_module(f"affordance.commands.{name.replace('-', '_')}")
    return cast(Command, module)
