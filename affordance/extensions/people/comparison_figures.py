"""Figures of a comparison of learners: log scores, and measured and predicted pushes."""

import itertools
import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.extensions.people.fit import Comparison
from affordance.extensions.people.pushes import Lifts
from affordance.extensions.people.rivals import label_learner
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy

_MOST_NAMED = 6  # largest number of participants for which the legend has names
_MOST_OBJECTS, _MOST_COLUMNS = 6, 3  # largest number of panels, one per object, and of columns of panels


def draw_scores(found: Comparison) -> Figure:
    """Plots log scores of all learners relative to each participant's best learner, one line per participant."""
    figure = Figure(figsize=(7.0, 0.5 * len(found.scores) + 1.6), layout="constrained")
    axes, names = figure.add_subplot(), [*found.scores]
    scores = np.array([*found.scores.values()])
    behind, places = scores - scores.max(axis=0), np.arange(len(names))
    for column, participant in enumerate(found.participants):
        axes.plot(behind[:, column], places, "o-", lw=0.6, ms=4, alpha=0.7, label=participant)
    axes.set_yticks(places, [label_learner(name) for name in names])
    axes.set(
        xlabel="log score behind the best learner of the participant (0: the best)", ylim=(len(names) - 0.5, -0.5)
    )
    tidy(axes)
    if len(found.participants) <= _MOST_NAMED:
        axes.legend(fontsize=FONT_SIZE, loc="best")
    return figure


def draw_pushes(found: Comparison, lifts: Lifts) -> Figure:
    """Plots measured and predicted mean pushes in successive lifts, one panel per object.

    Predictions are one lift ahead and come from learners that were fitted to each participant. Means are over all
    participants with a measured push in that lift.
    """
    objects = np.concatenate([person.objects for person in lifts.people])
    kinds, counts = np.unique(objects, return_counts=True)
    most = kinds[np.argsort(-counts, kind="stable")][:_MOST_OBJECTS].tolist()
    chosen = sorted(most, key=lambda kind: lifts.tools[kind].mass)
    columns = min(len(chosen), _MOST_COLUMNS)
    rows = math.ceil(len(chosen) / columns)
    figure = Figure(figsize=(3.6 * columns + 0.6, 2.7 * rows + 1.2), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for number, (panel, kind) in enumerate(zip(panels, chosen, strict=False)):
        _draw_object(panel, found, lifts, kind)
        if number % columns == 0:
            panel.set_ylabel("force (N)")
        if number + columns >= len(chosen):
            panel.set_xlabel("lift of this object")
    for panel in panels[len(chosen) :]:
        panel.remove()
    size = len(lifts.people)
    who = "one participant" if size == 1 else f"{size} participants (mean, standard error)"
    figure.suptitle(f"Force before each lift: {who}, and what fitted learners predict one lift ahead", fontsize=12)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=FONT_SIZE, frameon=False)
    return figure


def _draw_object(axes: Axes, found: Comparison, lifts: Lifts, kind: int) -> None:
    """Plots the lifts of one object."""
    people, tool = lifts.people, lifts.tools[kind]
    places = [np.flatnonzero(person.objects == kind) for person in people]
    pushes = _align([person.pushes for person in people], places)
    known = np.isfinite(pushes)
    count = known.sum(axis=0)
    axes.axhline(9.81 * tool.mass, color="0.4", lw=1.0, ls=":", label="weight of the object")
    number, size = 1 + np.flatnonzero(count), count[count > 0]

    def average(values: Array) -> Array:
        means: Array = np.where(known, values, 0.0).sum(axis=0)[count > 0] / size
        return means

    mean = average(pushes)
    *colours, black = OBJECT_COLOURS
    # A single participant has no standard error.
    squares = average(pushes**2) - mean**2
    error = np.sqrt(np.maximum(squares, 0.0) / np.where(size > 1, size - 1, np.nan))
    axes.errorbar(number, mean, error, fmt="o", ms=3, lw=0.7, color=black, label="people")
    for colour, (name, fits) in zip(itertools.cycle(colours), found.fits.items(), strict=False):
        predicted = average(_align([fit.predicted for fit in fits], places))
        axes.plot(number, predicted, "-", lw=1.4, color=colour, label=label_learner(name))
    axes.set_title(f"{tool.name}, {tool.mass:.3g} kg", fontsize=FONT_SIZE)
    axes.set_xlim(0.5, number[-1] + 0.5)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    tidy(axes)


def _align(values: list[Array], places: list[NDArray[np.intp]]) -> Array:
    """Arranges values by participant and lift of an object, (people, lifts), padded with NaN."""
    found = np.full((len(values), max(map(len, places))), np.nan)
    for row, (own, place) in enumerate(zip(values, places, strict=True)):
        found[row, : len(place)] = own[place]
    return found
