"""``affordance lift``: simulates the trials in a table, and writes a table with the observers' results."""

import argparse
from dataclasses import replace

from affordance.belief.learners import LEARNERS
from affordance.commands.answers import print_answer
from affordance.commands.options import check_bounds, open_robot, read_learner
from affordance.commands.people.people_options import open_table, read_contrasts
from affordance.commands.setups import check_own_name, read_setup
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.suite import run_suite
from affordance.extensions.people.experiments.table_lifts import TableExperiment, describe_means
from affordance.extensions.people.experiments.trials import check_cost
from affordance.extensions.people.participant import LiftSettings
from affordance.files.bounded import read_json
from affordance.named_settings import change_settings, parse_changes
from affordance.reporting.formatting import break_line
from affordance.settings import DEFAULT_SETTINGS


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, and writes the table of lifts, figures and a report."""
    check_bounds(arguments)
    changes = dict(parse_changes(arguments.changes))
    if "learner" in changes:
        raise BadValueError("--set", "learner", "has no effect here: learners are chosen by --learner")
    own = {name: changes.pop(name) for name in list(changes) if name.startswith("learner.")}
    if own and len(arguments.learner) != 1:
        raise BadValueError(
            "--set", next(iter(own)), "belongs to one learner, must be given with exactly one --learner"
        )
    robot = open_robot(arguments)
    learners = tuple(dict.fromkeys(map(read_learner, arguments.learner))) or tuple(LEARNERS.values())
    if own:
        learners = (change_settings(replace(DEFAULT_SETTINGS, learner=learners[0]), own).learner,)
    name = check_own_name(arguments.trials)
    table, tasks = open_table(arguments, arguments.trials, robot)
    check_cost(table, arguments.repeats, len(learners))
    contrasts = read_contrasts(arguments, table)
    trials = TableExperiment(name, table, tasks, arguments.repeats, learners, contrasts=contrasts)
    setup = replace(read_setup(arguments, robot, changes, LiftSettings), observers=trials.observers)
    report, _, findings = run_suite({name: Experiment(trials.run, trials.read)}, setup)
    numbers = read_json(setup.out / name / "metrics.json")
    means, width = numbers["means"], find_width()
    lines = [part for text in findings[name].splitlines() for part in break_line(text, width)]
    if not contrasts or arguments.details:
        lines.insert(0, describe_means(means, width))
    if table.unused:
        lines.append(f"Columns that lifts.csv does not contain: {', '.join(table.unused)}")
    lines += [f"The lifts: {setup.out / name / 'lifts.csv'}", f"The report: {report}"]
    content = {"contrasts": numbers["contrasts"], "means": means} if contrasts else means
    print_answer(arguments, "\n".join(lines), content)
    return 0
