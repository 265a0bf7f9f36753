"""Posterior predictive checks of fits to participants.

Statistics of a participant's pushes are compared with the same statistics of simulated participants, whose parameters
are drawn from the posterior. A statistic fails if its p-value is below .05 divided by the number of statistics
(Bonferroni correction), so that about one in twenty participants fails by chance.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.special import ndtr

from affordance.arrays import Array
from affordance.extensions.people.fit import Question
from affordance.extensions.people.likelihood import draw_courses, set_participant, split_free
from affordance.extensions.people.participant import Pushes, take, with_participant
from affordance.extensions.people.pushes import Person
from affordance.extensions.people.rivals import label_learner
from affordance.reporting.figures import FONT_SIZE
from affordance.runs.repeats import run_tasks

_SIMULATED, _FAILS = 400, 0.05
_MOST_SDS = 5.0  # end of the colour scale
_MOST_OBJECTS = 8  # largest number of objects with separate statistics


class Statistic(NamedTuple):
    """Statistic of a participant's pushes, compared with simulated participants."""

    name: str
    observed: float
    low: float  # 5 % quantile of simulated participants
    high: float  # 95 % quantile
    z: float  # difference from the mean of simulated participants, in their SDs
    p_value: float  # two-sided
    fails: bool


def check_person(question: Question, place: int, normal: Array) -> list[Statistic]:
    """Compares the pushes of a participant with simulated pushes.

    Args:
        question: Specification of the fit.
        place: Index of the participant.
        normal: Draws from the posterior of the participant, (D, F), in standard normal numbers.
    """
    person, names = question.lifts.people[place], [tool.name for tool in question.lifts.tools]
    simulated = simulate_pushes(question, place, normal)
    observed = compute_statistics(person, names, person.pushes[None])
    found = []
    for name, values in compute_statistics(person, names, simulated).items():
        here = float(observed[name][0])
        reached = min((values >= here).sum(), (values <= here).sum())
        p_value = min(1.0, 2.0 * (1.0 + float(reached)) / (1.0 + len(values)))
        z = float((here - values.mean()) / max(values.std(), 1e-12))
        if not reached:  # too extreme for counting: use the tail of a normal distribution
            p_value = min(p_value, 2.0 * float(ndtr(-abs(z))))
        low, high = np.quantile(values, [0.05, 0.95]).tolist()
        found.append(Statistic(name, here, low, high, z, p_value, p_value <= _FAILS / len(observed)))
    return found


def simulate_pushes(question: Question, place: int, normal: Array) -> Array:
    """Simulates pushes in a participant's lifts with parameters from the posterior, (S, N), [N]."""
    person, (own, pushed) = question.lifts.people[place], split_free(question.free)
    rng = np.random.default_rng([question.seed, place, 2])
    values = question.convert(normal[rng.integers(len(normal), size=_SIMULATED)])
    courses = draw_courses(
        person._replace(pushes=np.full(len(person.pushes), np.nan)),
        question.lifts.tools,
        question.learner,
        question.settings,
        question.free,
        values[:, own],
        particles=1,
        seeds=[(question.seed, place, 2, each) for each in range(_SIMULATED)],
    )
    fixed = with_participant(question.settings).participant
    participant = set_participant(fixed, [question.free[i] for i in pushed], values[:, pushed])
    pushes = Pushes(*(take(participant, name, range(_SIMULATED)) for name in ("push_error", "gain", "lapse")))
    lifts = zip(courses.believed[..., 0].T, courses.last[..., 0].T, strict=True)
    return np.column_stack([pushes.draw(believed, last, rng) for believed, last in lifts])


def compute_statistics(person: Person, names: list[str], pushes: Array) -> Mapping[str, Array]:
    """Computes statistics of pushes, (S, N), by name, (S,) each.

    Statistics for each of the most frequent objects are the first push and the mean of the last quarter. Statistics
    over all objects are the relative SD about the mean push for the object, and the correlation between successive
    deviations from this mean.
    """
    known = np.isfinite(person.pushes)
    objects, pushes = person.objects[known], pushes[:, known]
    kinds, counts = np.unique(objects, return_counts=True)
    found: dict[str, Array] = {}
    deviations = np.zeros(pushes.shape)
    for kind in kinds[np.argsort(-counts, kind="stable")].tolist():
        own = pushes[:, objects == kind]
        deviations[:, objects == kind] = own / own.mean(axis=1, keepdims=True) - 1.0
        if len(found) < 2 * _MOST_OBJECTS:
            found[f"first push of {names[kind]}"] = own[:, 0]
            found[f"last pushes of {names[kind]}"] = own[:, -max(1, own.shape[1] // 4) :].mean(axis=1)
    found["relative SD"] = deviations.std(axis=1)
    squares = (deviations**2).sum(axis=1)
    together = (deviations[:, 1:] * deviations[:, :-1]).sum(axis=1)
    found["correlation with the push before"] = together / np.where(squares > 0.0, squares, 1.0)
    return found


def check_all(question: Question, own: Sequence[Array]) -> list[list[Statistic]]:
    """Checks the fits to all participants, given their posterior draws, (D, F) each."""
    tasks = [partial(check_person, question, place, normal) for place, normal in enumerate(own)]
    return run_tasks(tasks, jobs=question.jobs, description="check")


def list_checks(question: Question, checks: Sequence[Sequence[Statistic]]) -> list[str]:
    """Formats checks as one line per participant and a summary."""
    lines, learner = [], question.learner.name
    for person, check in zip(question.lifts.people, checks, strict=True):
        failed = [each for each in check if each.fails]
        cells = [
            f"{each.name} {each.observed:.3g}, simulated {each.low:.3g} to {each.high:.3g} (p {each.p_value:.1g})"
            for each in failed
        ]
        said = f"not described by {learner}: {'; '.join(cells)}" if failed else f"as {learner} simulates"
        lines.append(f"check, {person.name}: {said}")
    count = sum(any(each.fails for each in check) for check in checks)
    return [*lines, f"{learner} does not describe {count} of {len(checks)} people"]


def draw_checks(question: Question, checks: Sequence[Sequence[Statistic]]) -> Figure:
    """Plots z-scores of all statistics and participants relative to simulated participants."""
    names = list(dict.fromkeys(each.name for check in checks for each in check))
    z = np.full((len(names), len(checks)), np.nan)
    figure = Figure(figsize=(0.55 * len(checks) + 4.5, 0.36 * len(names) + 1.8), layout="constrained")
    axes = figure.add_subplot()
    for column, check in enumerate(checks):
        for each in check:
            row = names.index(each.name)
            z[row, column] = each.z
            if each.fails:
                axes.text(column, row, f"{each.z:+.1f}", ha="center", va="center", fontsize=FONT_SIZE)
    image = axes.imshow(z, cmap="RdBu_r", vmin=-_MOST_SDS, vmax=_MOST_SDS, aspect="auto")
    axes.set_xticks(range(len(checks)), [person.name for person in question.lifts.people], rotation=90)
    axes.set_yticks(range(len(names)), names)
    axes.set_title(f"People, less what is simulated for them:\n{label_learner(question.learner.name)}")
    figure.colorbar(image, label="SDs of simulated people (number: it fails)")
    return figure
