"""``affordance predict EXPERIMENT``: predicts the behaviour of every learner before data exist."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from affordance.arguments import check_number
from affordance.belief.learners import list_learners
from affordance.commands.answers import print_answer
from affordance.commands.catalogue import EXPERIMENTS
from affordance.commands.options import check_bounds, open_robot, read_changes
from affordance.commands.people.arguments import MOST_OBSERVERS
from affordance.commands.people.people_options import SUFFIXES, open_table, read_contrasts
from affordance.commands.setups import check_experiment, check_learner, check_own_name, open_experiment, read_setup
from affordance.commands.terminal import find_width
from affordance.exceptions import BadValueError
from affordance.experiments.shared.experiment import Experiment
from affordance.experiments.shared.observers import Setup
from affordance.extensions.people.experiments.planned_contrasts import (
    compute_effects,
    count_for,
    describe_effects,
    describe_sizes,
    list_content,
)
from affordance.extensions.people.experiments.prediction import describe_best, format_predictions, predict
from affordance.extensions.people.experiments.table_lifts import TableExperiment
from affordance.extensions.people.experiments.trials import check_cost
from affordance.extensions.people.participant import LiftSettings
from affordance.files.atomic import write_json
from affordance.files.bounded import read_json
from affordance.named_settings import change_settings
from affordance.reporting.formatting import break_line
from affordance.robot import Robot
from affordance.runs.repeats import check_folder
from affordance.settings import DEFAULT_SETTINGS


def run(arguments: argparse.Namespace) -> int:
    """Prints means with intervals, the spread between observers, and the best measurement."""
    check_number("--power", arguments.power, 0.5, 0.999)
    if arguments.people_sd is not None:
        check_number("--people-sd", arguments.people_sd, 1e-6, 1e3, "N")
    path = Path(arguments.experiment)
    if path.suffix in SUFFIXES:
        check_bounds(arguments)
        robot = open_robot(arguments)
        name = check_own_name(path)
        table, tasks = open_table(arguments, path, robot)
        learners = tuple(list_learners(change_settings(DEFAULT_SETTINGS, read_changes(arguments)).learner))
        planned = read_contrasts(arguments, table)
        trials = TableExperiment(name, table, tasks, arguments.repeats or 1, learners, arguments.people_sd, planned)
        check_cost(table, trials.repeats, len(trials.learners))
        arguments.repeats = trials.observers
        experiment = Experiment(trials.run, trials.read, trials.predict, settings=LiftSettings)
        return _predict(name, experiment, arguments, robot, planned=trials if planned else None)
    for option in ("objects", "columns", "contrast", "people_sd", "meshes", "materials"):
        if getattr(arguments, option):
            problem = f"is for a table of trials, must be omitted for {arguments.experiment}"
            raise BadValueError(f"--{option.replace('_', '-')}", "", problem)
    check_experiment(arguments, EXPERIMENTS, or_file=True)
    with open_experiment(arguments.experiment) as (name, experiment):
        if arguments.repeats is None:
            arguments.repeats = min(MOST_OBSERVERS, experiment.observers)
        check_bounds(arguments)
        robot = open_robot(arguments)
        return _predict(name, experiment, arguments, robot, is_own=name not in EXPERIMENTS)


def _predict(
    name: str,
    experiment: Experiment,
    arguments: argparse.Namespace,
    robot: Robot,
    *,
    is_own: bool = False,
    planned: TableExperiment | None = None,
) -> int:
    """Predicts an experiment. A user's own experiment is first tested with one observer.

    ``planned`` is the experiment if it is a table with planned contrasts. The answer then consists of these
    contrasts.
    """
    if (measure := experiment.predict) is None:
        problem = f"is {arguments.experiment!r}, which uses one learner for all observers; use run once per --learner"
        raise BadValueError("experiment", "", problem)
    if arguments.repeats < 2:
        raise BadValueError("--repeats", "", f"is {arguments.repeats}, must be at least 2")
    changes = read_changes(arguments)
    check_learner("predict", changes)
    check_folder(arguments.out)
    setup = read_setup(arguments, robot, changes, experiment.settings)
    experiment.read(setup)
    if is_own:
        measure(replace(setup, observers=1, jobs=1))
    found = predict(name, setup, measure, power=arguments.power)
    content, width = read_json(found.path), find_width()
    if planned is not None:
        lines, content["planned_contrasts"] = _predict_contrasts(planned, setup, arguments.power)
        write_json(found.path, content)
    else:
        lines = [describe_best(found.predictions, found.contrasts)]
    lines = [part for line in lines for part in break_line(line, width)]
    if arguments.details:
        details = format_predictions(found.meanings, found.predictions, found.contrasts, found.spreads, width)
        lines += [details]
    print_answer(arguments, "\n".join([*lines, f"The predictions: {found.path}"]), content)
    return 0


def _predict_contrasts(
    experiment: TableExperiment, setup: Setup, power: float
) -> tuple[list[str], list[dict[str, Any]]]:
    """Computes planned contrasts and the required numbers of people, as lines of text and as content for a file."""
    contrasts = experiment.contrasts
    effects = compute_effects(contrasts, experiment.collect(setup))
    sizes = [
        count_for(each, own, experiment.people_sd, contrasts=len(contrasts), power=power)
        for each, own in zip(contrasts, effects, strict=True)
    ]
    lines = []
    for each, own, size in zip(contrasts, effects, sizes, strict=True):
        lines.append(describe_effects(each, own))
        lines += [describe_sizes(each, size)] if own else []
    return lines, list_content(contrasts, effects, sizes)
