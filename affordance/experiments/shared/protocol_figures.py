"""Figures of presentations, as a protocol asks for them: objects, heights, beliefs, and forces lift by lift."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array, Arrays
from affordance.experiments.definition import OBSERVER_SHOWN
from affordance.experiments.shared.presented import QUARTILES, PresentationExperiment
from affordance.experiments.shared.trajectories import HEIGHTS
from affordance.objects.tool import Tool
from affordance.protocols.measured import predict_from_line, select_presentations
from affordance.protocols.number_entries import FigureEntry, Measure
from affordance.protocols.people import list_people
from affordance.reporting import figures, statistics
from affordance.reporting.formatting import label
from affordance.reporting.lift_figures import LiftCurve, PeopleMark, draw_lifts
from affordance.reporting.object_drawings import Drawing, draw_objects


def draw_figures(experiment: PresentationExperiment, arrays: Arrays) -> dict[str, Callable[[], Figure]]:
    """Returns a function for each figure but those of single trials; but for lifts, of the first learner."""
    draw = {"objects": _draw_objects, "heights": _draw_heights, "heights of points": _draw_points}
    draw |= {"density and drop": _draw_density, "lifts": _draw_lifts}
    return {
        name: partial(draw[entry.draw], entry, experiment, arrays)
        for name, entry in experiment.figures.items()
        if entry.draw in draw
    }


def _draw_objects(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Figure:
    objects = experiment.objects
    decoys = [] if entry.decoy is None else objects.select(entry.decoy)
    drawings = []
    for number, tool in enumerate(objects.select(entry.of), start=1):
        name = label(tool.name)
        if tool not in decoys:
            drawings.append(Drawing(tool, f"{number}: {name}"))
            continue
        drawings.append(Drawing(tool, f"{number}: {name}, as it looks"))
        drawings.append(Drawing(tool, f"{number}: {name}, as it is made", as_made=True))
    return draw_objects(drawings, columns=2)


def _draw_heights(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    return figures.draw_heights(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        labels=[tool.name for tool in _list_presented(entry, experiment, arrays)],
        shown_label=f"seed {experiment.seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_points(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    decoy = FigureEntry(draw=entry.draw, of=entry.decoy or entry.of)
    points = {name: _select(arrays[name], decoy, experiment, arrays)[:, -1] for name in HEIGHTS}
    titles = {"height_centre": "geometric centre", "height_grip": "grip", "height_com": "true centre of mass"}
    names = [tool.name for tool in _list_presented(entry, experiment, arrays)]
    return figures.draw_heights_of_points(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        decoy={titles[name]: statistics.estimate_mean(points[name]) for name in titles},
        labels=[f"{number}: {name}" for number, name in enumerate(names, start=1)],
        shown_label=f"seed {experiment.seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_density(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    quartiles = [experiment.quantiles.index(each) for each in QUARTILES]
    tools = _list_presented(entry, experiment, arrays)

    def select(values: Any) -> Any:  # before the first presentation and after each one that is drawn
        return np.concatenate([values[:, :1], _select(values[:, 1:], entry, experiment, arrays)], axis=1)

    return figures.draw_density_and_drop(
        quartiles=np.median(select(arrays["density_quantiles"])[..., quartiles], axis=0),
        mode=np.median(select(arrays["density_mode"]), axis=0),
        density_true=tools[0].components[0].material.density,
        drop=statistics.estimate_mean(statistics.compute_drop(height)),
        masses=np.array([tool.mass for tool in tools]),
        num_repeats=len(height),
    )


def _select(values: Any, entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Any:
    """Selects the values of the drawn presentations, those with a motion, (R, n, ...)."""
    moves = experiment.layout.find_measured(Measure.DROP)
    return select_presentations(values[:, moves], arrays["presented"][:, moves], experiment.objects.groups[entry.of])


def _list_presented(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> list[Tool]:
    """Lists the objects among those drawn that were presented to the observer who is shown."""
    shown = _select(arrays["presented"], entry, experiment, arrays)[OBSERVER_SHOWN]
    return [experiment.tools[index] for index in shown]


def _draw_lifts(entry: FigureEntry, experiment: PresentationExperiment, arrays: Arrays) -> Figure:
    """Draws the lifts of a group of objects, one panel per learner: forces, or shares where weights differ."""
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
                    predict_between(*row, drawn=group, others=others, tools=experiment.tools)
                    for row in zip(presented, forces, strict=True)
                ]
            )
        curves.append(LiftCurve(learner.label, select_presentations(forces, presented, group), predicted))
    weights = select_presentations(arrays["weight"][:, taken], arrays["presented"][:, taken], group)
    people = _mark(experiment, entry, weights.shape[1])
    people_lifts = _list_people_lifts(experiment, group, weights.shape[1])
    if np.ptp(weights) and not people and not len(people_lifts):  # each observer's own object in each lift
        curves = [curve.divide(weights) for curve in curves]
        return draw_lifts(curves, weights=None, people=(), title=entry.title)
    return draw_lifts(curves, weights=weights[0], people=people, people_lifts=people_lifts, title=entry.title)


def _list_people_lifts(experiment: PresentationExperiment, group: Sequence[int], count: int) -> Array:
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


def _mark(experiment: PresentationExperiment, entry: FigureEntry, count: int) -> list[PeopleMark]:
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
        elif number.predicted_for == entry.of:
            first = last = count + 1
        else:
            continue
        people = found[name]
        marks.append(PeopleMark(number.meaning or name, people.value, people.low, people.high, first, last))
    return marks


def predict_between(
    presented: Any, forces: Any, *, drawn: Sequence[int], others: Sequence[int], tools: Sequence[Tool]
) -> list[float]:
    """Predicts forces, [N], of the drawn objects, after each of their lifts, by a line through others' volumes.

    The objects presented, (K,), and their forces, (K,), [N], are in order; others predict in the lifts between one of
    the drawn and the next.
    """
    predicted = []
    places = np.flatnonzero(np.isin(presented, drawn))
    for start, end in zip(places, [*places[1:], len(presented)], strict=True):
        between = np.arange(start, end)
        chosen = between[np.isin(presented[between], others)]
        values, of = forces[chosen], presented[chosen]
        is_line = len(np.unique(of)) > 1
        predicted.append(predict_from_line(values, of, tools, tools[presented[start]]) if is_line else np.nan)
    return predicted
