"""Catalogue of the commands, experiments and learners that the command line finds by name.

Only this module imports from both the paper and all extensions. Everything is imported when it is first used, so that
``--help`` is fast and the paper's simulations run without the extensions.
"""

import argparse
import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

from affordance.exceptions import BadArgumentError, describe_choice

if TYPE_CHECKING:  # these imports need Drake, but doctor and --help must run without it
    from affordance.belief.learner import Learner
    from affordance.experiments.shared.experiment import Experiment


class Entry(NamedTuple):
    """Command of the program.

    Attributes:
        help: One line of help.
        example: Arguments of the example at the end of the help.
        folder: Subfolder of ``commands`` with the command's module; empty if there is none. A dash in the name of a
            command becomes an underscore in the name of its module.
    """

    help: str
    example: str
    folder: str = ""


SUBJECTS: Mapping[str, Mapping[str, Entry]] = {
    "The paper's simulations": {
        "run": Entry(
            "run the paper's simulations or other experiments; write numbers, figures and a report",
            "weight --repeats 20",
        ),
        "watch": Entry("watch an observer in an experiment, live in the browser", "com", "watch"),
        "film": Entry("write a film of an experiment: the arm with each object, side by side", "weight out.gif"),
    },
    "Experiments with people": {
        "predict": Entry(
            "predict what each learner would do in an experiment, and which number separates them best",
            "weight --repeats 20",
            "people",
        ),
        "lift": Entry(
            "simulate the trials of a table: observers lift, hold or look at objects",
            "--trials trials.csv --objects objects.yaml",
            "people",
        ),
        "fit": Entry(
            "fit a learner to the pushes of people, person by person or pooled",
            "lifts.csv --learner kinds_drawn",
            "people",
        ),
        "compare-learners": Entry(
            "find the learner that predicts each person's lifts best, one trial ahead", "lifts.csv", "people"
        ),
        "new-trials": Entry(
            "write a table of trials with balanced orders, and for PsychoPy, jsPsych or BIDS",
            "trials.csv --objects objects.yaml --block 'learn: all x 5' --for psychopy",
            "people",
        ),
        "freeze": Entry(
            "freeze the plan of an experiment for a preregistration, and check it later",
            "trials.csv --objects objects.yaml --claim 'Large is heavier than small'",
            "people",
        ),
        "new-experiment": Entry(
            "write a runnable example experiment in Python, for you to change", "my_experiment", "people"
        ),
    },
    "Choice of tools": {
        "see": Entry(
            "measure an object in a colour and depth picture of your own, for guess, rank and next",
            "cup.png --depth cup_depth.png --camera camera.json --at 312 240 --holds liquid",
            "pixels",
        ),
        "guess": Entry(
            "estimate mass, centre of mass and inertia of objects from their appearance, before they are held",
            "tools.yaml",
            "advice",
        ),
        "rank": Entry(
            "rank tools and grips for a task, from drawings or pictures, and give the reasons",
            "hammer --demo",
            "advice",
        ),
        "next": Entry(
            "advise which object to hold next before a tool is chosen, and when to stop", "hammer reach", "advice"
        ),
        "new-tools": Entry("write a commented tools file to fill in, for rank and next", "my_tools.yaml", "advice"),
    },
    "Robots and recordings": {
        "import-arm": Entry(
            "make a model folder for the arm in a robot's file (URDF, SDF or MJCF)",
            "robot.urdf --out my_arm",
            "robots",
        ),
        "compare-robots": Entry(
            "compare two files of one robot, joint by joint: mass, centre of mass, inertia, limits",
            "old.urdf new.urdf",
            "robots",
        ),
        "excite": Entry(
            "design a motion from which mass, centre of mass or inertia can be identified",
            "--for com",
            "payload",
        ),
        "identify": Entry(
            "identify a payload from recordings: mass, centre of mass and inertia, with intervals",
            "--demo",
            "payload",
        ),
        "weigh": Entry(
            "weigh the load of a force-torque sensor, from a few poses and without a robot's file",
            "poses.csv",
            "payload",
        ),
        "compare-payloads": Entry(
            "test if two payloads (from identify, live, weigh or a data sheet) are the same body",
            "belief.json sheet.yaml",
            "payload",
        ),
        "feed-forward": Entry(
            "compute the gravity torque and its error for each joint of a robot with a payload",
            "--payload belief.json --posture 0 0.5 0 1.2 0 0.3 0",
            "payload",
        ),
        "live": Entry(
            "identify what a running robot holds now, with intervals; sends no commands to the robot",
            "--demo",
            "payload",
        ),
        "memory": Entry(
            "show, edit or verify a lasting memory of the objects that robots have held",
            "show robot.sqlite",
            "memory",
        ),
    },
    "Program": {
        "study": Entry("run a long study (minutes to hours); without NAME, list all", "people"),
        "tutorials": Entry("copy the tutorials (notebooks) to a folder, and open Jupyter there", "--copy-only"),
        "doctor": Entry("check which parts work on this machine, and say how to install the others", ""),
    },
}
COMMANDS = {name: entry for group in SUBJECTS.values() for name, entry in group.items()}

# Experiments by name, each with its module and the name of the object. The paper's four experiments come first.
_PEOPLE = "affordance.extensions.people.experiments"
_EXPERIMENTS = {
    "weight": ("affordance.experiments.weight", "EXPERIMENT"),
    "com": ("affordance.experiments.com", "EXPERIMENT"),
    "reach": ("affordance.experiments.reach", "EXPERIMENT"),
    "hammer": ("affordance.experiments.hammer", "EXPERIMENT"),
    "vision": ("affordance.extensions.pixels.experiments.vision", "EXPERIMENT"),
    "linear_plus": (f"{_PEOPLE}.linear", "LINEAR_PLUS"),
    "linear_plus_plus": (f"{_PEOPLE}.linear", "LINEAR_PLUS_PLUS"),
}
EXPERIMENTS = tuple(_EXPERIMENTS)
OF_THE_PAPER = EXPERIMENTS[:4]
# Experiments for which learners' predictions are compared.
PREDICTED = ("weight", "com", "linear_plus", "linear_plus_plus")
# Words that can be used without ``run``, as in ``affordance weight``.
SHORT = ("all", "weight", "com", "reach", "hammer", "vision")

# The program's learners by name, each with its module and the name of the object.
_LEARNERS = {
    "density": ("affordance.belief.learners", "DENSITY"),
    "kinds_map": ("affordance.belief.learners", "KINDS_MAP"),
    "kinds_drawn": ("affordance.belief.learners", "KINDS_DRAWN"),
    "nothing_remembered": ("affordance.extensions.people.rivals", "NOTHING_REMEMBERED"),
    "own_memory": ("affordance.extensions.people.rivals", "OWN_MEMORY"),
    "own_and_shared": ("affordance.extensions.people.rivals", "OWN_AND_SHARED"),
}
LEARNER_NAMES = tuple(_LEARNERS)
# Learners that are compared by default, and the default learner of a single observer.
COMPARED, DEFAULT_LEARNER = LEARNER_NAMES[:3], "density"


class Command(Protocol):
    """Interface of a command's module."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Adds the command's arguments to a parser."""

    def run(self, arguments: argparse.Namespace) -> int:
        """Runs the command and returns its exit status.

        Raises:
            AffordanceError: The input is invalid. The message is one line.
        """


class _LazyCommand:
    """Command whose module is imported when it runs. Its arguments are declared in a module that imports quickly."""

    def __init__(self, name: str) -> None:
        folder, self._word = COMMANDS[name].folder, name.replace("-", "_")
        self._package = f"affordance.commands.{folder}" if folder else "affordance.commands"

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Adds the command's arguments to a parser."""
        _load(f"{self._package}.arguments", f"declare_{self._word}")(parser)

    @property
    def run(self) -> Callable[[argparse.Namespace], int]:
        """Function that runs the command and returns its exit status."""
        return cast(Callable[[argparse.Namespace], int], _load(f"{self._package}.{self._word}", "run"))


def load_command(name: str) -> Command:
    """Returns the command with a given name."""
    return cast(Command, _LazyCommand(name))


def find_experiment(name: str) -> "Experiment":
    """Imports an experiment by name.

    Raises:
        BadArgumentError: The name is unknown.
    """
    if name not in _EXPERIMENTS:
        raise BadArgumentError("experiment", "", describe_choice(name, EXPERIMENTS))
    return cast("Experiment", _load(*_EXPERIMENTS[name]))


def find_learner(name: str) -> "Learner | None":
    """Imports a built-in learner by name. Returns None if the name is unknown."""
    return cast("Learner", _load(*_LEARNERS[name])) if name in _LEARNERS else None


def _load(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name)
