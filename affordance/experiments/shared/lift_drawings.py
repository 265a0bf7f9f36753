"""Figures of forces lift by lift, for any protocol with a clamp: of every learner, and of people."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.experiments.definition import Arrays
from affordance.experiments.shared.presented import LABELS, PresentedExperiment
from affordance.objects.tool import Tool
from affordance.protocols.measured import compute_volume, select_presentations
from affordance.protocols.number_entries import FigureEntry, Measure
from affordance.protocols.people import list_people
from affordance.reporting.lift_figures import LiftCurve, PeopleMark, draw_lifts

# Name of the figures in a protocol.
LIFTS = "lifts"


def draw_lift_figures(experiment: PresentedExperiment, arrays: Arrays) -> dict[str, Callable[[], Figure]]:
    """Returns a function for each figure of lifts of a protocol.

    Args:
        experiment: Experiment of the protocol.
        arrays: Arrays of all observers of all learners.
    """
    return {
        name: partial(_draw, experiment, entry, arrays)
        for name, entry in experiment.figures.items()
        if entry.draw == LIFTS
    }


def _draw(experiment: PresentedExperiment, entry: FigureEntry, arrays: Arrays) -> Figure:
    """Draws the lifts of a group of objects, one panel per learner."""
    group = experiment.objects.groups[entry.of]
    taken = experiment.layout.find_measured(Measure.FORCE)
    curves = []
    for learner in experiment.learners:
        found = experiment.select(arrays, learner)
        presented, forces = found["presented"][:, taken], found["force"][:, taken]
        predicted = None
        if entry.predicted_from is not None:
            others = experiment.objects.groups[entry.predicted_from]
            predicted = np.array(
                [
                    predict_between(*row, drawn=group, others=others, tools_there_are=experiment.tools)
                    for row in zip(presented, forces, strict=True)
                ]
            )
        curves.append(LiftCurve(LABELS[learner], select_presentations(forces, presented, group), predicted))
    weights = select_presentations(arrays["weight"][:, taken], arrays["presented"][:, taken], group)
    return draw_lifts(
        curves,
        weights=weights[0],
        people=_mark(experiment, entry, weights.shape[1]),
        people_lifts=_list_people_lifts(experiment, group, weights.shape[1]),
        title=entry.title,
    )


def _list_people_lifts(experiment: PresentedExperiment, group: Sequence[int], count: int) -> Array:
    """Returns people's forces in the first lifts of a group, one row per person, (P, C), [N]; NaN where missing."""
    lifts = experiment.people.lifts
    if lifts is None:
        return np.zeros((0, count))
    unmeasured = [index for index, block in enumerate(experiment.blocks) if not block.measured]
    rows = np.full((len(lifts.people), count), np.nan)
    for row, person in zip(rows, lifts.people.values(), strict=True):
        forces = person.force[np.isin(person.tool, group) & ~np.isin(person.block, unmeasured)][:count]
        row[: len(forces)] = forces
    return rows


def _mark(experiment: PresentedExperiment, entry: FigureEntry, count: int) -> list[PeopleMark]:
    """Returns marks of people's forces among the lifts, from the numbers of the group that is drawn."""
    if experiment.people.table is None:
        return []
    found = list_people(experiment.numbers, experiment.people._replace(lifts=None))
    marks = []
    for name, number in experiment.numbers.items():
        if name not in found or number.measure is not Measure.FORCE:
            continue
        if number.of == entry.of:
            first, last = (1, number.first or count) if number.last is None else (count - number.last + 1, count)
            marks.append(PeopleMark(number.meaning or name, found[name], first, last))
        elif number.predicted_for == entry.of:
            marks.append(PeopleMark(number.meaning or name, found[name], count + 1, count + 1))
    return marks


def predict_between(
    presented: Any, forces: Any, *, drawn: Sequence[int], others: Sequence[int], tools_there_are: Sequence[Tool]
) -> list[float]:
    """Predicts forces of the drawn objects, after each of their lifts, by a line through other objects' volumes, [N].

    Args:
        presented: Indices of the lifted objects, (K,).
        forces: Forces of these lifts, (K,), [N].
        drawn: Indices of the objects whose force is predicted.
        others: Indices of the objects that predict, in the lifts between one of the drawn and the next.
        tools_there_are: Objects of the protocol.
    """
    volumes = np.array([compute_volume(tool) for tool in tools_there_are])
    places = np.flatnonzero(np.isin(presented, drawn))
    predicted = []
    for start, end in zip(places, [*places[1:], len(presented)], strict=True):
        between = np.arange(start, end)
        chosen = between[np.isin(presented[between], others)]
        if len(np.unique(presented[chosen])) < 2:
            predicted.append(np.nan)
            continue
        slope, intercept = np.polyfit(volumes[presented[chosen]], forces[chosen], 1)
        predicted.append(float(intercept + slope * volumes[presented[start]]))
    return predicted
