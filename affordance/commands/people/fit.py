"""``affordance fit``: fits a learner's parameters to the lifts of people, person by person or pooled."""

import argparse
import json
from dataclasses import replace
from typing import Any

import numpy as np

from affordance.commands.options import read_learner
from affordance.commands.people.people_options import (
    ask,
    prepare_new_folder,
    read_setting,
)
from affordance.exceptions import BadValueError
from affordance.extensions.people.fit import (
    describe_fit,
    describe_values,
    find_best,
    fit_each,
    fit_pooled,
    leave_out,
    score_ahead,
    warn_of_noise,
    write_fit,
)
from affordance.extensions.people.tempered_smc import Draws
from affordance.files.atomic import write_json


def run(arguments: argparse.Namespace) -> int:
    """Prints means and 90 % intervals of free parameters, log scores one step ahead, and the noise of particles."""
    settings, lifts = read_setting(arguments)
    names = None if arguments.free is None else [each.strip() for each in arguments.free.split(",")]
    if not 1 <= arguments.chains <= 16:
        nearest = min(max(arguments.chains, 1), 16)
        raise BadValueError("--chains", "", f"is {arguments.chains}, must be from 1 to 16; the nearest is {nearest}")
    question = ask(arguments, settings, lifts, read_learner(arguments.learner), names)
    question = replace(question, chains=arguments.chains)
    if not question.free:
        raise BadValueError("--free", "", "is empty, must name a parameter")
    people: dict[str, dict[str, Any]] = {}
    everyone: dict[str, dict[str, Any]] = {}
    found: Draws | list[Draws] = fit_pooled(question) if arguments.pooled else fit_each(question)
    noise = question.estimate_noise(find_best(question, found))
    tree = describe_fit(question, found)
    counts = [int(np.isfinite(person.pushes).sum()) for person in lifts.people]
    if isinstance(found, Draws):
        scores, effective = leave_out(found.log_likelihoods)
        everyone["everyone"] = describe_values(question, found)
        for place, person in enumerate(lifts.people):
            left_out = {"log_score_left_out": float(scores[place].sum()), "draws_left_out": float(effective[place])}
            people[person.name] = {"pushes": counts[place], **left_out, "particle_noise": float(noise[place])}
    else:
        for place, (person, draws) in enumerate(zip(lifts.people, found, strict=True)):
            score = float(score_ahead(draws.prior_log_likelihoods).sum())
            own = {"pushes": counts[place], "log_score": score, **describe_values(question, draws)}
            people[person.name] = {**own, "particle_noise": float(noise[place])}
    folder = prepare_new_folder(arguments.out / f"fit_{arguments.lifts.stem}")
    write_fit(tree, folder)
    content = {"learner": question.learner.name, "free": question.names, **everyone, "participants": people}
    write_json(folder / "fit.json", content)
    if arguments.json:
        print(json.dumps(content, indent=2))
        return 0
    for name, numbers in {**everyone, **people}.items():
        cells = [
            f"{key} {value[0]:.3g} [{value[1]:.3g}, {value[2]:.3g}]"
            if isinstance(value, list)
            else f"{key} {value:.5g}"
            for key, value in numbers.items()
        ]
        print(f"{name}: {', '.join(cells)}")
    for line in warn_of_noise([*people], noise):
        print(line)
    print(f"Means and 90 % intervals. The fit, for ArviZ: {folder}")
    return 0
