"""``affordance fit``: fits a learner's parameters to the lifts of people, person by person or pooled."""

import argparse
import json
from dataclasses import replace
from typing import Any

import numpy as np

from affordance.belief.learner_file import load_learner
from affordance.commands.options import add_out
from affordance.commands.people_options import NAMES, add_fit_options, ask, read_setting
from affordance.exceptions import BadValueError
from affordance.files.atomic import write_json
from affordance.people.fit import (
    describe_fit,
    describe_values,
    fit_each,
    fit_pooled,
    leave_out,
    score_ahead,
    write_fit,
)
from affordance.runs.repeats import prepare_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add = parser.add_argument
    add_fit_options(parser)
    add("--learner", required=True, metavar="LEARNER", help=NAMES)
    what = "parameters to fit, such as kappa,own_drift (default: push_error and the learner's fitted ones)"
    add("--free", metavar="NAMES", help=what)
    add("--chains", type=int, default=1, metavar="C", help="independent samplers, for r_hat of ArviZ (default 1)")
    add("--pooled", action="store_true", help="one value for all participants (default: one for each)")
    add("--json", action="store_true", help="print the result as JSON")
    add_out(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints means and 90 % intervals of the free parameters, and log scores one step ahead."""
    settings, lifts = read_setting(arguments)
    names = None if arguments.free is None else [each.strip() for each in arguments.free.split(",")]
    if not 1 <= arguments.chains <= 16:
        nearest = min(max(arguments.chains, 1), 16)
        raise BadValueError("--chains", "", f"is {arguments.chains}, must be from 1 to 16; the nearest is {nearest}")
    question = ask(arguments, settings, lifts, load_learner(arguments.learner), names)
    question = replace(question, chains=arguments.chains)
    if not question.free:
        raise BadValueError("--free", "", "is empty, must name a parameter")
    people: dict[str, dict[str, Any]] = {}
    everyone: dict[str, dict[str, Any]] = {}
    if arguments.pooled:
        pooled = fit_pooled(question)
        tree = describe_fit(question, pooled)
        scores, effective = leave_out(pooled.log_likelihoods)
        for place, person in enumerate(lifts.people):
            left_out = {"log_score_left_out": float(scores[place].sum()), "draws_left_out": float(effective[place])}
            people[person.name] = {"pushes": int(np.isfinite(person.pushes).sum()), **left_out}
        everyone["everyone"] = describe_values(question, pooled)
    else:
        each = fit_each(question)
        tree = describe_fit(question, each)
        for person, draws in zip(lifts.people, each, strict=True):
            score = float(score_ahead(draws.prior_log_likelihoods).sum())
            found = describe_values(question, draws)
            people[person.name] = {"pushes": int(np.isfinite(person.pushes).sum()), "log_score": score, **found}
    folder = prepare_folder(arguments.out / f"fit_{arguments.lifts.stem}")
    write_fit(tree, folder)
    content = {"learner": question.learner.name, "free": question.names, **everyone, "participants": people}
    write_json(folder / "fit.json", content)
    if arguments.json:
        print(json.dumps(content, indent=2))
        return 0
    for name, found in {**everyone, **people}.items():
        cells = [
            f"{key} {value[0]:.3g} [{value[1]:.3g}, {value[2]:.3g}]"
            if isinstance(value, list)
            else f"{key} {value:.5g}"
            for key, value in found.items()
        ]
        print(f"{name}: {', '.join(cells)}")
    print(f"Means and 90 % intervals. The fit, for ArviZ: {folder}")
    return 0
