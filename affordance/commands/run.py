"""``affordance run``: runs experiments, and writes numbers, figures and a report."""

import argparse
import sys
from collections.abc import Mapping, Sequence

from affordance.arguments import JOBS, REPEATS, check_number, check_whole
from affordance.commands import answers, options
from affordance.commands.catalogue import EXPERIMENTS, OF_THE_PAPER, find_experiment
from affordance.commands.setups import check_experiment, check_learner, open_experiment, read_setup
from affordance.commands.terminal import find_width
from affordance.exceptions import AffordanceError
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.experiments.shared.suite import rehearse, run_suite
from affordance.files.bounded import read_json
from affordance.plant.load import load_arm
from affordance.proprioception.faults import load_faults
from affordance.reporting.formatting import break_line, count_observers, format_duration
from affordance.robot import Robot
from affordance.runs.repeats import check_folder
from affordance.settings import Settings

# Exit status if some of several experiments could not be run.
LEFT_OUT = 3


def run(arguments: argparse.Namespace) -> int:
    """Runs the experiments and returns the exit status, which is LEFT_OUT if some could not be run."""
    if arguments.experiment == "all":
        return _run({name: find_experiment(name) for name in OF_THE_PAPER}, arguments)
    check_experiment(arguments, ("all", *EXPERIMENTS), or_file=True)
    with open_experiment(arguments.experiment) as (name, experiment):
        return _run({name: experiment}, arguments, is_own=name not in EXPERIMENTS)


def _run(experiments: Mapping[str, Experiment], arguments: argparse.Namespace, *, is_own: bool = False) -> int:
    """Runs experiments. A user's own experiment is first tested with one observer."""
    if arguments.repeats is None:
        arguments.repeats = 1 if arguments.memory else max(each.observers for each in experiments.values())
    options.check_bounds(arguments)
    changes = options.read_changes(arguments)
    for name, each in experiments.items():
        if each.every_learner:
            check_learner(name, changes)
    robot = options.open_robot(arguments)
    if arguments.robot is not None and arguments.robot.is_file():
        answers.tell(arguments, f"{arguments.robot.name}: models in {robot.folder}")
    kinds = {each.settings for each in experiments.values()}
    setup = read_setup(arguments, robot, changes, kinds.pop() if len(kinds) == 1 else Settings)
    setup = change_by_extensions(setup, arguments, robot)
    if arguments.fault:
        joint_names = load_arm(setup.settings.arm).joint_names
        faults = load_faults(robot.folder / "faults.yaml", arguments.fault, joint_names)
        setup = setup.change(faults=faults)
    if is_own and setup.observers > 1:
        check_folder(setup.out)
        for name, each in experiments.items():
            each.read(setup)
            rehearse(name, each, setup)
        answers.tell(arguments, "One observer passed the whole analysis; now all others are run.")
    report, left_out, findings = run_suite(
        experiments,
        setup,
        begin=lambda names: answers.tell(arguments, describe_plan(names, setup)) if len(names) > 1 else None,
        announce=lambda page: answers.tell(arguments, f"The report so far: {page.resolve().as_uri()}"),
    )
    numbers = {name: str(setup.out / name / "metrics.json") for name in experiments if name not in left_out}
    content = {"report": str(report), "numbers": numbers, "findings": findings, "left_out": left_out}
    width = find_width()
    lines = [line for name, finding in findings.items() for line in break_line(f"{name}: {finding}", width)]
    answers.print_answer(arguments, "\n".join([*lines, f"The report: {report}"]), content)
    if left_out:
        print(f"Left out, for reasons given in the report: {', '.join(left_out)}", file=sys.stderr)
        return LEFT_OUT
    return 0


def change_by_extensions(setup: Setup, arguments: argparse.Namespace, robot: Robot) -> Setup:
    """Applies the options that add extensions to an observer's setup: vision from pictures, and a lasting memory."""
    if arguments.vision == "pixels":
        from affordance.extensions.pixels.pixel_eye import PIXELS  # imported here, because few runs need it

        setup = setup.change(eye=PIXELS)
    return options.remember(setup, arguments, robot) if arguments.memory else setup


def describe_plan(names: Sequence[str], setup: Setup) -> str:
    """Describes the plan of a run. Its expected duration is estimated from earlier runs in the same folder."""
    seconds, unknown = 0.0, []
    for name in names:
        try:
            kept = read_json(setup.out / name / "metrics.json")
            jobs, repeats, took = kept["config"]["jobs"], kept["repeats"], kept["wall_s"]
            share = check_whole("repeats", repeats, REPEATS) / setup.observers * setup.jobs
            seconds += check_number("wall_s", took, 0.0) * check_whole("jobs", jobs, JOBS) / share
        except (AffordanceError, KeyError, TypeError):
            unknown.append(name)
    what = f"{', '.join(names)}: {count_observers(setup.observers)} each, {setup.jobs} at a time, into {setup.out}/."
    if len(unknown) == len(names):
        return f"{what} No earlier run in this folder shows how long it takes; --repeats 10 gives a quick look."
    missing = f", not counting {', '.join(unknown)} (no earlier run)" if unknown else ""
    return f"{what} According to earlier runs it takes about {format_duration(seconds)}{missing}."
