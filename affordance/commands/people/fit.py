"""``affordance fit``: fits a learner's parameters to people's lifts, individually, by group or pooled."""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from affordance.commands.options import read_learner
from affordance.commands.people.people_options import KEPT, ask, prepare_new_folder, read_setting
from affordance.exceptions import BadValueError
from affordance.extensions.people.fit import (
    PersonFit,
    Question,
    describe_fit,
    describe_values,
    find_best,
    fit_each,
    fit_pooled,
    leave_out,
    warn_of_noise,
    write_fit,
)
from affordance.extensions.people.groups import describe_groups, draw_groups, list_groups
from affordance.extensions.people.predictive_check import check_all, draw_checks, list_checks
from affordance.files.atomic import write_json
from affordance.reporting.figures import save_figure


def run(arguments: argparse.Namespace) -> int:
    """Prints means and 90 % intervals of free parameters, one-step-ahead log scores, and particle noise."""
    for option in ("group", "check"):
        if arguments.pooled and getattr(arguments, option):
            raise BadValueError(f"--{option}", "", "cannot be used with --pooled: it needs a fit of each participant")
    settings, lifts = read_setting(arguments)
    names = None if arguments.free is None else [each.strip() for each in arguments.free.split(",")]
    if not 1 <= arguments.chains <= 16:
        nearest = min(max(arguments.chains, 1), 16)
        raise BadValueError("--chains", "", f"is {arguments.chains}, must be from 1 to 16; the nearest is {nearest}")
    question = ask(arguments, settings, lifts, read_learner(arguments.learner), names)
    question = replace(question, chains=arguments.chains)
    if not question.free:
        raise BadValueError("--free", "", "is empty, must name a parameter")
    content: dict[str, Any] = {"learner": question.learner.name, "free": question.names}
    if arguments.pooled:
        pooled = fit_pooled(question, arguments.out / KEPT)
        tree = describe_fit(question, pooled)
        content["everyone"] = describe_values(question, pooled)
        noise = question.estimate_noise(find_best(question, pooled))
        scores, effective = leave_out(pooled.log_likelihoods)
        own = [
            {"log_score_left_out": float(score.sum()), "draws_left_out": float(count)}
            for score, count in zip(scores, effective, strict=True)
        ]
    else:
        found = fit_each(question, arguments.out / KEPT)
        tree = describe_fit(question, [each.draws for each in found])
        noise = np.array([each.noise for each in found])
        own = [_describe_person(question, each) for each in found]
    content["participants"] = {
        person.name: {"pushes": int(np.isfinite(person.pushes).sum()), **values, "particle_noise": float(sd)}
        for person, values, sd in zip(lifts.people, own, noise, strict=True)
    }
    folder = prepare_new_folder(arguments.out / f"fit_{arguments.lifts.stem}")
    lines = _list_values(
        {**({"everyone": content["everyone"]} if arguments.pooled else {}), **content["participants"]}
    )
    lines += warn_of_noise([person.name for person in lifts.people], noise)
    if arguments.group:
        groups, people = ([getattr(each, name) for each in lifts.people] for name in ("group", "name"))
        drawn = draw_groups([each.draws.normal for each in found], groups, arguments.seed)
        content["group"] = describe_groups(question.free, people, groups, drawn)
        lines += list_groups(content["group"])
    if arguments.check:
        checks = check_all(question, [each.draws.normal for each in found])
        content["check"] = {
            person.name: [each._asdict() for each in check]
            for person, check in zip(lifts.people, checks, strict=True)
        }
        lines += list_checks(question, checks)
        save_figure(draw_checks(question, checks), folder, "check")
    write_fit(tree, folder)
    write_json(folder / "fit.json", content)
    print(json.dumps(content, indent=2) if arguments.json else "\n".join([*lines, _close(folder)]))
    return 0


def _describe_person(question: Question, found: PersonFit) -> dict[str, Any]:
    return {
        "log_score": found.draws.log_evidence,
        **describe_values(question, found.draws),
        "particles": found.particles,
    }


def _list_values(people: dict[str, dict[str, Any]]) -> list[str]:
    lines = []
    for name, numbers in people.items():
        cells = [
            f"{key} {value[0]:.3g} [{value[1]:.3g}, {value[2]:.3g}]"
            if isinstance(value, list)
            else f"{key} {value:.5g}"
            for key, value in numbers.items()
        ]
        lines.append(f"{name}: {', '.join(cells)}")
    return lines


def _close(folder: Path) -> str:
    return f"Means and 90 % intervals. The fit, for ArviZ: {folder}"
