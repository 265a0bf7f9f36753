"""``affordance lift``: lets observers do the trials of a table, and writes the table with what they did."""

import argparse
import json
from dataclasses import replace
from pathlib import Path

from affordance.belief.learner_file import load_learner
from affordance.belief.learners import LEARNERS
from affordance.commands.options import add_run_options, check_bounds, read_robot, refuse_changes
from affordance.commands.setups import read_setup
from affordance.commands.tables import add_table_options, open_table
from affordance.experiments.suite import Experiment, check_own_name, run_suite
from affordance.experiments.table_lifts import TableExperiment
from affordance.experiments.trials import check_cost
from affordance.files.bounded import read_json
from affordance.named_settings import parse_changes
from affordance.reporting.lift_means import describe_means
from affordance.robots.kept import open_robot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add("--trials", type=Path, required=True, metavar="FILE", help="table with a row for each trial (CSV)")
    add_table_options(parser)
    what = (
        f"{', '.join(LEARNERS)}, or one's own as FILE.py:CLASS, a program that is run; more than once (default: all)"
    )
    add("--learner", action="append", default=[], metavar="LEARNER", help=what)
    add("--json", action="store_true", help="print the means as JSON")
    add_run_options(parser, 1, "observers of each learner for each participant", models="")


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, and writes the table with what was measured, figures and a report."""
    check_bounds(arguments)
    refuse_changes(arguments, ["learner"], "--learner says which, more than once")
    robot = open_robot(*read_robot(arguments))
    learners = tuple(dict.fromkeys(map(load_learner, arguments.learner))) or tuple(LEARNERS.values())
    name = check_own_name(arguments.trials)
    table, tasks = open_table(arguments, arguments.trials, robot)
    check_cost(table, arguments.repeats, len(learners))
    trials = TableExperiment(name, table, tasks, arguments.repeats, learners)
    setup = replace(read_setup(arguments, robot, parse_changes(arguments.changes)), observers=trials.observers)
    report, _ = run_suite({name: Experiment(trials.run, trials.read)}, setup)
    means = read_json(setup.out / name / "metrics.json")["means"]
    if arguments.json:
        print(json.dumps(means, indent=2))
        return 0
    print(describe_means(means))
    if table.unused:
        print(f"Columns that are left out of lifts.csv: {', '.join(table.unused)}")
    print(f"The lifts: {setup.out / name / 'lifts.csv'}")
    print(f"The report: {report}")
    return 0
