"""``affordance run``: runs experiments, and writes their numbers, figures and report."""

import argparse
import sys
from collections.abc import Mapping
from typing import Any

from affordance.commands import options
from affordance.commands.setups import check_experiment, check_learner, read_setup
from affordance.exceptions import BadValueError
from affordance.experiments.suite import (
    DESIGNS,
    NAMES,
    OF_THE_PAPER,
    Experiment,
    find_experiment,
    open_experiment,
    rehearse,
    run_suite,
)
from affordance.memory.past_arms import describe_past_arms
from affordance.plant.load import load_arm
from affordance.proprioception.faults import load_faults
from affordance.robots.kept import open_robot
from affordance.runs.repeats import check_folder
from affordance.vision.features import FeatureSource

# Exit status if some of several experiments were left out.
LEFT_OUT = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    others = ", ".join(name for name in (*NAMES, *DESIGNS) if name not in OF_THE_PAPER)
    what = f"{', '.join(OF_THE_PAPER)}, all of these (default), one of {others}, or a Python file"
    add("experiment", nargs="?", default="all", help=what)
    what = (
        "simulated observers, for vision objects (default: 200; for lifts of people's experiments 50 of each learner)"
    )
    options.add_run_options(parser, None, what, models="")
    what = "true features of objects (default), or from a picture of each; vision always takes pictures"
    add("--vision", choices=[source.value for source in FeatureSource], help=what)
    options.add_learner(parser)
    what = "what is to be wrong, of the models' faults.yaml; more than once"
    add("--fault", action="append", default=[], help=what)
    what = "lasting memory (SQLite file): the observer begins with it, and every trial is appended"
    add("--memory", default="", metavar="MEMORY", help=what)
    options.add_same_colours(parser)
    add("--cluster", metavar="ADDRESS", help="Dask scheduler to send observers to, in place of --jobs")


def run(arguments: argparse.Namespace) -> int:
    """Runs the experiments; returns the exit status, LEFT_OUT if some of them were left out."""
    if arguments.experiment == "all":
        return _run({name: find_experiment(name) for name in OF_THE_PAPER}, arguments)
    check_experiment(arguments, ("all", *NAMES, *DESIGNS))
    with open_experiment(arguments.experiment) as (name, experiment):
        return _run({name: experiment}, arguments, is_own=name not in (*NAMES, *DESIGNS))


def _run(experiments: Mapping[str, Experiment], arguments: argparse.Namespace, *, is_own: bool = False) -> int:
    """Runs experiments; one of a user's own with one observer first."""
    if arguments.repeats is None:
        arguments.repeats = 1 if arguments.memory else max(each.observers for each in experiments.values())
    options.check_bounds(arguments)
    changes = _list_changes(arguments)
    for name, each in experiments.items():
        if each.every_learner:
            check_learner(name, changes)
    robot = open_robot(*options.read_robot(arguments))
    if arguments.robot is not None and arguments.robot.is_file():
        print(f"{arguments.robot.name}: models in {robot.folder}")
    if past := describe_past_arms(robot.name, robot.count_past_arms(arguments.memory)):
        print(past, flush=True)
    setup = read_setup(arguments, robot, changes)
    if arguments.fault:
        joint_names = load_arm(setup.settings.arm).joint_names
        faults = load_faults(robot.folder / "faults.yaml", arguments.fault, joint_names)
        setup = setup.change(faults=faults)
    if is_own and setup.observers > 1:
        check_folder(setup.out)
        for name, each in experiments.items():
            each.read(setup)
            rehearse(name, each, setup)
        print("One observer went through the whole analysis; now all others.", flush=True)
    report, left_out = run_suite(
        experiments,
        setup,
        cluster=arguments.cluster,
        announce=lambda page: print(f"The report, which grows: {page.resolve().as_uri()}", flush=True),
    )
    print(f"The report: {report}")
    if left_out:
        print(f"Left out, as the report says: {', '.join(left_out)}", file=sys.stderr)
        return LEFT_OUT
    return 0


def _list_changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Collects the changes of settings, from ``--set`` and from options of their own."""
    changes = options.read_changes(arguments)
    if arguments.vision is not None:
        if "feature_source" in changes:
            raise BadValueError("--set", "feature_source", "is given with --vision, only one of them may be")
        changes["feature_source"] = arguments.vision
    return changes
