"""Figures of forces in successive lifts, with human data."""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from affordance.arrays import Array
from affordance.extensions.people.rivals import label_learner
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import count_observers, label
from affordance.reporting.statistics import estimate_mean

_BLACK = "#000000"
# Largest number of observers drawn individually, and of objects with a row of panels.
_MOST_DRAWN, _MOST_OBJECTS = 30, 8
_MOST_COLUMNS = 3  # of panels side by side, so that text is readable on a slide


class LiftCurve(NamedTuple):
    """Forces of R observers of a learner in C lifts, (R, C), [N].

    If given, ``predicted`` are the forces that follow from other objects alone, (R, C), [N].
    """

    label: str
    forces: Array
    predicted: Array | None

    def divide(self, weights: Array) -> "LiftCurve":
        """Divides forces by the true weights of the objects, (R, C), [N]."""
        return LiftCurve(
            self.label, self.forces / weights, None if self.predicted is None else self.predicted / weights
        )


class PeopleMark(NamedTuple):
    """Mean of people with its 95 % interval, [N], for a range of lifts. Lifts are counted from 1."""

    label: str
    value: float
    low: float
    high: float
    first: int
    last: int


def draw_lifts(
    curves: Sequence[LiftCurve],
    *,
    weights: Array | None,
    people: Sequence[PeopleMark],
    title: str,
) -> Figure:
    """Plots forces in successive lifts, one panel per learner. Panels show individual observers and human intervals.

    Args:
        curves: Forces of each learner's observers.
        weights: True weight in each of C lifts, (C,), [N]; None if forces were divided by it.
        people: Means of people, drawn in every panel.
        title: Title of the figure.
    """
    columns = min(len(curves), _MOST_COLUMNS)
    rows = math.ceil(len(curves) / columns)
    figure = Figure(figsize=(4.0 * max(2, columns), 1.3 + 3.0 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = grid.ravel()[: len(curves)]
    for axes in grid.ravel()[len(curves) :]:
        axes.remove()
    for axes, curve, colour in zip(panels, curves, OBJECT_COLOURS, strict=False):
        lifts = np.arange(1, curve.forces.shape[1] + 1)
        for row in curve.forces[:_MOST_DRAWN]:
            axes.plot(lifts, row, color=colour, linewidth=0.5, alpha=0.35)
        mean = estimate_mean(curve.forces)
        axes.plot(lifts, mean.mean, color=colour, linewidth=2.2, label="mean of observers")
        axes.fill_between(lifts, mean.low, mean.high, color=colour, alpha=0.25, linewidth=0.0)
        if curve.predicted is not None:
            predicted = curve.predicted.mean(axis=0)
            axes.plot(lifts, predicted, "--", color=colour, linewidth=1.4, label="predicted by the other objects")
        truth = np.ones(len(lifts)) if weights is None else weights
        axes.step(lifts, truth, color=_BLACK, linewidth=0.9, linestyle=":", where="mid", label="true weight")
        for mark, shape in zip(people, "os^Dv", strict=False):
            middle, half = 0.5 * (mark.first + mark.last), 0.5 * (mark.last - mark.first)
            errors = [[mark.value - mark.low], [mark.high - mark.value]]
            axes.errorbar(
                [middle],
                [mark.value],
                yerr=errors,
                xerr=half or None,
                fmt=shape,
                color=_BLACK,
                markersize=5,
                capsize=3,
                label=f"people: {mark.label.removesuffix(', N')}",  # the axis has the unit
                zorder=5,
            )
        axes.set_title(f"{curve.label}, {count_observers(len(curve.forces))}", fontsize=FONT_SIZE)
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("lift")
        tidy(axes)
    unit = "over weight" if weights is None else "(N)"
    for axes in grid[:, 0]:
        axes.set_ylabel(f"force before release {unit}")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=2)
    figure.suptitle(title, fontsize=FONT_SIZE + 1)
    return figure


def draw_by_object(lifts: pd.DataFrame, column: str, title: str) -> Figure:
    """Plots a column of a lift table over trials. Objects are rows of panels, learners are columns.

    Each group has its own colour. If there are many objects, only the first are drawn.
    """
    lifts = lifts[lifts[column].notna()]
    objects = list(dict.fromkeys(lifts["object"]))[:_MOST_OBJECTS]
    learners, groups = list(dict.fromkeys(lifts["learner"])), list(dict.fromkeys(lifts["group"]))
    figure = Figure(figsize=(1.0 + 3.2 * max(2, len(learners)), 1.0 + 2.3 * len(objects)), layout="constrained")
    panels = figure.subplots(len(objects), len(learners), sharey="row", squeeze=False)
    for row, name in zip(panels, objects, strict=True):
        for axes, learner in zip(row, learners, strict=True):
            own = lifts[(lifts["object"] == name) & (lifts["learner"] == learner)]
            for number, group in enumerate(groups):
                colour = OBJECT_COLOURS[number % len(OBJECT_COLOURS)]
                _draw_group(axes, own[own["group"] == group], column, colour, label(group))
            axes.set_title(f"{label(name)}, {learner}", fontsize=FONT_SIZE)
            tidy(axes)
        row[0].set_ylabel(title)
    for axes in panels[-1]:
        axes.set_xlabel("trial with this object")
    for axes in panels.flat:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    handles, labels = panels[0][0].get_legend_handles_labels()
    if len(groups) > 1:
        figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=4)
    return figure


def _draw_group(axes: Axes, lifts: pd.DataFrame, column: str, colour: str, name: str) -> None:
    """Plots a group's trials with one object.

    Observers are thin lines, their mean has its interval, and the weight is dotted.
    """
    if lifts.empty:
        return
    number = lifts.groupby("observer").cumcount() + 1
    table = lifts.assign(number=number).pivot(index="number", columns="observer", values=column)
    for each in list(table)[:_MOST_DRAWN]:
        axes.plot(table.index, table[each], color=colour, linewidth=0.5, alpha=0.35)
    estimates = [estimate_mean(row[np.isfinite(row)]) for row in table.to_numpy()]
    mean, low, high = (
        np.array([float(getattr(each, part)) for each in estimates]) for part in ("mean", "low", "high")
    )
    axes.plot(table.index, mean, color=colour, linewidth=2.2, marker="o", markersize=2.5, label=name)
    axes.fill_between(table.index, low, high, color=colour, alpha=0.25, linewidth=0.0)
    if column == "force":
        weights = lifts.assign(number=number).groupby("number")["weight"].mean()
        axes.step(weights.index, weights, color=colour, linewidth=0.9, linestyle=":", where="mid")


def draw_forces(
    lifts: pd.DataFrame,
    objects: Sequence[str],
    *,
    title: str,
    predicted_by: Sequence[str] = (),
    people: Sequence[PeopleMark] = (),
) -> Figure:
    """Plots the lift forces for some objects, one panel per learner.

    Where the objects' weights differ, forces are divided by the weight. The dashed curve is the prediction from other
    objects: a line through force and size, fitted to their lifts between this lift and the next plotted one.

    Args:
        lifts: Table of lifts of all observers, with forces and weights, [N], and sizes, [m^3].
        objects: Names of the objects whose lifts are drawn.
        title: Title of the figure.
        predicted_by: Names of the objects that predict the force; nothing is predicted if empty.
        people: Published results of people to mark.
    """
    chosen = lifts[lifts["object"].isin(objects)]
    observers = lifts["observer"].nunique()
    curves = []
    for learner, own in lifts.groupby("learner", sort=False):
        forces = own.loc[own["object"].isin(objects), "force"].to_numpy().reshape(observers, -1)
        predicted = None
        if predicted_by:
            rows = [_predict(each, objects, predicted_by) for _, each in own.groupby("observer")]
            predicted = np.array(rows)
        curves.append(LiftCurve(label_learner(str(learner)), forces, predicted))
    weights = chosen["weight"].to_numpy()[: curves[0].forces.size].reshape(observers, -1)
    if np.ptp(weights) and not people:
        return draw_lifts([curve.divide(weights) for curve in curves], weights=None, people=(), title=title)
    return draw_lifts(curves, weights=weights[0], people=people, title=title)


def _predict(lifts: pd.DataFrame, objects: Sequence[str], others: Sequence[str]) -> list[float]:
    """Predicts the force in each lift of ``objects`` from the subsequent lifts of ``others``."""
    places = [*np.flatnonzero(lifts["object"].isin(objects)), len(lifts)]
    predicted = []
    for start, end in itertools.pairwise(places):
        between = lifts.iloc[start:end]
        between = between[between["object"].isin(others)]
        predicted.append(predict_by_size(between, float(lifts["size"].iloc[start])) if len(between) > 1 else np.nan)
    return predicted


def predict_by_size(lifts: pd.DataFrame, size: float) -> float:
    """Predicts the force for a size, [m^3], by a linear fit to other lifts, [N]."""
    slope, intercept = np.polyfit(lifts["size"].to_numpy(), lifts["force"].to_numpy(), 1)
    return float(intercept + slope * size)
