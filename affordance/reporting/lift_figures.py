"""Figures of forces lift by lift: observers of each learner, and human data."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import estimate_mean

_PEOPLE = "#000000"
# Most observers that are drawn one by one.
_MOST_DRAWN = 30


class LiftCurve(NamedTuple):
    """Forces of the observers of one learner.

    Attributes:
        label: Name of the learner.
        forces: Forces of R observers in C lifts, (R, C), [N].
        predicted: Forces predicted from those for the other objects, (R, C), [N]; None to omit them.
    """

    label: str
    forces: Array
    predicted: Array | None


class PeopleMark(NamedTuple):
    """Human data for some of the lifts.

    Attributes:
        label: Name of the quantity.
        value: Mean, [N].
        low: Lower end of the mean's 95 % interval, [N].
        high: Upper end of the mean's 95 % interval, [N].
        first: Number of the first of these lifts, from 1.
        last: Number of the last of these lifts.
    """

    label: str
    value: float
    low: float
    high: float
    first: int
    last: int


def draw_lifts(
    curves: Sequence[LiftCurve],
    *,
    weights: Array,
    people: Sequence[PeopleMark],
    title: str,
    people_lifts: Array | None = None,
) -> Figure:
    """Draws forces lift by lift: one panel per learner, single observers thin, human intervals in each.

    Args:
        curves: Forces of each learner.
        weights: True weight in each lift, (C,), [N].
        people: Human means; empty if there are no data.
        title: Title of the figure.
        people_lifts: Forces of P persons lift by lift, (P, C), [N], NaN where missing; drawn behind.
    """
    figure = Figure(figsize=(4.0 * max(2, len(curves)), 4.3), layout="constrained")
    panels = figure.subplots(1, len(curves), sharex=True, sharey=True, squeeze=False)[0]
    for axes, curve, colour in zip(panels, curves, OBJECT_COLOURS, strict=False):
        lifts = np.arange(1, curve.forces.shape[1] + 1)
        if people_lifts is not None and len(people_lifts):
            _draw_people(axes, lifts, people_lifts)
        for row in curve.forces[:_MOST_DRAWN]:
            axes.plot(lifts, row, color=colour, linewidth=0.5, alpha=0.35)
        mean = estimate_mean(curve.forces)
        axes.plot(lifts, mean.mean, color=colour, linewidth=2.2, label="mean of observers")
        axes.fill_between(lifts, mean.low, mean.high, color=colour, alpha=0.25, linewidth=0.0)
        if curve.predicted is not None:
            predicted = curve.predicted.mean(axis=0)
            axes.plot(lifts, predicted, "--", color=colour, linewidth=1.4, label="predicted by the other objects")
        axes.step(lifts, weights, color=_PEOPLE, linewidth=0.9, linestyle=":", where="mid", label="true weight")
        for mark, shape in zip(people, "os^Dv", strict=False):
            middle, half = 0.5 * (mark.first + mark.last), 0.5 * (mark.last - mark.first)
            errors = [[mark.value - mark.low], [mark.high - mark.value]]
            axes.errorbar(
                [middle],
                [mark.value],
                yerr=errors,
                xerr=half or None,
                fmt=shape,
                color=_PEOPLE,
                markersize=5,
                capsize=3,
                label=f"people: {mark.label}",
                zorder=5,
            )
        axes.set_title(f"{curve.label}, {count_observers(len(curve.forces))}", fontsize=FONT_SIZE)
        axes.set_xlabel("lift")
        tidy(axes)
    panels[0].set_ylabel("upward force before release (N)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=2)
    figure.suptitle(title, fontsize=FONT_SIZE + 1)
    return figure


def _draw_people(axes: Axes, lifts: Array, forces: Array) -> None:
    """Draws human lifts in grey behind the observers': each person thin, and their mean with its interval."""
    for row in forces[:_MOST_DRAWN]:
        axes.plot(lifts, row, color=_PEOPLE, linewidth=0.4, alpha=0.25, zorder=0.5)
    there = np.isfinite(forces).all(axis=0)
    mean = estimate_mean(forces[:, there])
    axes.fill_between(lifts[there], mean.low, mean.high, color=_PEOPLE, alpha=0.12, linewidth=0.0, zorder=0.6)
    label = f"{len(forces)} people, mean and 95 % interval"
    axes.plot(lifts[there], mean.mean, color=_PEOPLE, linewidth=1.4, alpha=0.55, zorder=0.7, label=label)
