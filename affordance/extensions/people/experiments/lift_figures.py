"""Figures of lift forces over trials, with human data."""

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
# Largest number of individually plotted observers, and of objects (rows of panels).
_MOST_DRAWN, _MOST_OBJECTS = 30, 8
_MOST_COLUMNS = 3  # largest number of columns of panels, so that text is readable on a slide


class LiftCurve(NamedTuple):
    """Lift forces of R observers with the same learner in C lifts."""

    label: str
    forces: Array  # (R, C), [N]
    predicted: Array | None  # forces predicted from other objects, (R, C), [N]

    def divide(self, weights: Array) -> "LiftCurve":
        """Normalises forces by the true weights of the objects, (R, C), [N]."""
        return LiftCurve(
            self.label, self.forces / weights, None if self.predicted is None else self.predicted / weights
        )


class PeopleMark(NamedTuple):
    """Human mean lift force with 95 % interval, [N], for a range of lifts."""

    label: str
    value: float
    low: float
    high: float
    first: int  # first lift of the range, from 1
    last: int


def draw_lifts(
    curves: Sequence[LiftCurve],
    *,
    weights: Array | None,
    people: Sequence[PeopleMark],
    title: str,
) -> Figure:
    """Plots lift forces of individual observers and human means, one panel per learner.

    Args:
        curves: Forces of the observers of each learner.
        weights: True weight in each of C lifts, (C,), [N]; None if forces are normalised.
        people: Human means, plotted in every panel.
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
    """Plots a column of a lift table over trials, with rows of panels for objects and columns for learners.

    Colours distinguish groups. Only the first objects are plotted if there are many.
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
    """Plots a group's trials with one object: thin lines of observers, mean with interval, and dotted weight."""
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
    """Plots lift forces for some objects, one panel per learner.

    If the weights of the objects differ, forces are divided by weight. A dashed curve shows the force that a linear
    regression on size predicts from the lifts of other objects between this lift and the next plotted lift.

    Args:
        lifts: Table of lifts of all observers, with forces and weights, [N], and sizes, [m^3].
        objects: Names of the plotted objects.
        title: Title of the figure.
        predicted_by: Names of the objects for the prediction; empty for no prediction.
        people: Published human results.
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
    """Predicts the force in each lift of ``objects`` from the lifts of ``others`` before the next of these lifts."""
    places = [*np.flatnonzero(lifts["object"].isin(objects)), len(lifts)]
    predicted = []
    for start, end in itertools.pairwise(places):
        between = lifts.iloc[start:end]
        between = between[between["object"].isin(others)]
        predicted.append(predict_by_size(between, float(lifts["size"].iloc[start])) if len(between) > 1 else np.nan)
    return predicted


def predict_by_size(lifts: pd.DataFrame, size: float) -> float:
    """Predicts the force for a size, [m^3], with a linear regression of force on size in other lifts, [N]."""
    slope, intercept = np.polyfit(lifts["size"].to_numpy(), lifts["force"].to_numpy(), 1)
    return float(intercept + slope * size)
