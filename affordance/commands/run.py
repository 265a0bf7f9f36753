"""``affordance run``: runs experiments, and writes their numbers, figures and report."""

import argparse
import sys
from typing import Any

from affordance.belief.learner import Learner
from affordance.commands import options
from affordance.exceptions import BadValueError
from affordance.experiments.suite import DEFAULT_REPEATS, EXPERIMENTS, run_suite
from affordance.files.model_folder import list_studies
from affordance.memory.past_arms import describe_past_arms
from affordance.named_settings import parse_changes
from affordance.objects.materials import MATERIALS, load_materials
from affordance.protocols.protocol import find_number_of_observers
from affordance.robots.kept import open_robot
from affordance.vision.features import FeatureSource

# Experiments whose number of repeats is not in a file.
NOT_PROTOCOLS = ("vision",)
# Exit status if some of several experiments were left out.
LEFT_OUT = 3
# Options that set a setting, and the setting's name.
_OPTIONS = {"learner": "learner", "vision": "feature_source"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    what = f"{', '.join(EXPERIMENTS)}, all of these (default), or a protocol (path or name)"
    add("experiment", nargs="?", default="all", help=what)
    what = "simulated observers, for vision objects (default: as many as a protocol says, or "
    options.add_run_options(parser, None, f"{what}{DEFAULT_REPEATS})", models="")
    what = "true features of objects (default), or from a picture of each; vision always takes pictures"
    add("--vision", choices=[source.value for source in FeatureSource], help=what)
    what = "one density for each colour (default; the paper's), or kinds within a colour, most probable or drawn"
    add("--learner", choices=[learner.value for learner in Learner], help=what)
    what = "what is to be wrong, of the models' faults.yaml; more than once"
    add("--fault", action="append", default=[], help=what)
    what = "lasting memory (SQLite file): the observer begins with it, and every trial is appended"
    add("--memory", default="", metavar="MEMORY", help=what)
    options.add_same_colours(parser)
    add("--cluster", metavar="ADDRESS", help="Dask scheduler to send repeats to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs the experiments; returns the exit status, LEFT_OUT if some of them were left out."""
    arguments.repeats = _find_repeats(arguments)
    options.check_bounds(arguments)
    options.check_experiment(arguments, (*EXPERIMENTS, "all"))
    all_there = [name for name in EXPERIMENTS if name not in NOT_PROTOCOLS or name in list_studies()]
    robot = open_robot(*options.read_robot(arguments))
    if arguments.robot is not None and arguments.robot.is_file():
        print(f"{arguments.robot.name}: models in {robot.folder}")
    if past := describe_past_arms(robot.name, robot.count_past_arms(arguments.memory)):
        print(past, flush=True)
    materials = load_materials(robot.folder / MATERIALS.name) if arguments.same_colour else {}
    report, left_out = run_suite(
        all_there if arguments.experiment == "all" else [arguments.experiment],
        arguments.out,
        models=robot.folder,
        seed=arguments.seed,
        repeats=arguments.repeats,
        jobs=arguments.jobs,
        faults=arguments.fault,
        cluster=arguments.cluster,
        changes=_list_changes(arguments),
        memory=arguments.memory,
        same_colours=options.read_same_colours(arguments, materials),
        announce=lambda page: print(f"The report, which grows: {page.resolve().as_uri()}", flush=True),
    )
    print(f"The report: {report}")
    if left_out:
        names = ", ".join(left_out)
        print(f"Left out, as the report says: {names}", file=sys.stderr)
        return LEFT_OUT
    return 0


def _find_repeats(arguments: argparse.Namespace) -> int:
    """Finds the number of repeats: from the command line, else from the protocol, else the default."""
    if arguments.repeats is not None:
        return int(arguments.repeats)
    if arguments.memory:
        return 1  # a memory is of one observer
    if arguments.experiment in ("all", *NOT_PROTOCOLS):
        return DEFAULT_REPEATS
    options.check_experiment(arguments, (*EXPERIMENTS, "all"))
    return find_number_of_observers(arguments.experiment, options.find_shipped(arguments)) or DEFAULT_REPEATS


def _list_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Collects the changes of settings, from ``--set`` and from options of their own."""
    changes = parse_changes(arguments.changes)
    for option, name in _OPTIONS.items():
        value = getattr(arguments, option)
        if value is not None:
            if name in changes:
                raise BadValueError("--set", name, f"is given with --{option}, only one of them may be")
            changes[name] = value
    return changes
