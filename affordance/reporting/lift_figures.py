"""Figures of learners: forces lift by lift with human data, and the memory of a learner with kinds."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.belief.kinds_summary import KindSummary
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import count_observers
from affordance.reporting.statistics import estimate_mean

_BLACK = "#000000"
# Most observers that are drawn one by one.
_MOST_DRAWN = 30


class LiftCurve(NamedTuple):
    """Forces of R observers of a learner in C lifts, (R, C), [N], and if given those predicted from other objects."""

    label: str
    forces: Array
    predicted: Array | None

    def divide(self, weights: Array) -> "LiftCurve":
        """Divides forces by the true weights of the lifted objects, (R, C), [N]."""
        return LiftCurve(
            self.label, self.forces / weights, None if self.predicted is None else self.predicted / weights
        )


class PeopleMark(NamedTuple):
    """Mean of people with its 95 % interval, [N], for some of the lifts, from first to last, from 1."""

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
    people_lifts: Array | None = None,
) -> Figure:
    """Draws forces lift by lift: one panel per learner, single observers thin, human intervals in each.

    True weights in each lift, (C,), [N], are None if forces were divided by them. Forces of P people lift by lift,
    (P, C), [N], NaN where missing, are drawn behind.
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
                label=f"people: {mark.label}",
                zorder=5,
            )
        axes.set_title(f"{curve.label}, {count_observers(len(curve.forces))}", fontsize=FONT_SIZE)
        axes.set_xlabel("lift")
        tidy(axes)
    unit = "(true weights)" if weights is None else "(N)"
    panels[0].set_ylabel(f"upward force before release {unit}")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, loc="outside lower center", ncols=2)
    figure.suptitle(title, fontsize=FONT_SIZE + 1)
    return figure


def _draw_people(axes: Axes, lifts: Array, forces: Array) -> None:
    """Draws human lifts in grey behind the observers': each person thin, and their mean with its interval."""
    for row in forces[:_MOST_DRAWN]:
        axes.plot(lifts, row, color=_BLACK, linewidth=0.4, alpha=0.25, zorder=0.5)
    there = np.isfinite(forces).all(axis=0)
    mean = estimate_mean(forces[:, there])
    axes.fill_between(lifts[there], mean.low, mean.high, color=_BLACK, alpha=0.12, linewidth=0.0, zorder=0.6)
    label = f"{len(forces)} people, mean and 95 % interval"
    axes.plot(lifts[there], mean.mean, color=_BLACK, linewidth=1.4, alpha=0.55, zorder=0.7, label=label)


def draw_kinds(kinds: Sequence[KindSummary], *, title: str) -> Figure:
    """Draws each kind as a bar of mean ± 2 standard deviations, with its objects below.

    A filled marker is an object's own density, an open one that of its kind. The label gives the object's length, the
    number of times it was lifted as a member of the kind, and its probability of membership.

    Args:
        kinds: Kinds from ``summarise_kinds``, at least one.
        title: Title of the figure.
    """
    heights = [1 + len(kind.objects) for kind in kinds]
    figure = Figure(figsize=(8.0, 1.2 + 0.28 * (sum(heights) + len(kinds))))
    axes = figure.subplots()
    row, ticks, labels = 0.0, [], []
    for number, kind in enumerate(kinds, start=1):
        width = max(4.0 * kind.sd, 1.0)
        axes.barh(row, width, left=kind.density - 2.0 * kind.sd, color=kind.colour, edgecolor=_BLACK, height=0.7)
        axes.plot([kind.density, kind.density], [row - 0.35, row + 0.35], color=_BLACK, linewidth=1.4)
        ticks.append(row)
        most = ", most populous" if kind.is_most_populous else ""
        labels.append(f"kind {number}{most}\n{kind.density:.0f} ± {kind.sd:.0f} kg/m³")
        for known in kind.objects:
            row += 1.0
            face = kind.colour if known.has_own else "none"
            spread = 2.0 * known.sd if known.has_own else 0.0
            error = spread or None
            axes.errorbar(known.density, row, xerr=error, fmt="o", color=_BLACK, markerfacecolor=face, capsize=2.0)
            length = 200.0 * max(max(part.sizes) for part in known.appearance)
            lifts = f"{known.num_lifts} lift{'' if known.num_lifts == 1 else 's'}"
            axes.annotate(
                f"object {length:.0f} cm long, {lifts}, p = {known.probability:.3f}",
                (known.density + spread, row),
                xytext=(9, 0),
                textcoords="offset points",
                va="center",
                fontsize=FONT_SIZE - 2,
            )
        row += 1.6
    axes.set_yticks(ticks, labels)
    axes.invert_yaxis()
    axes.set(
        xlabel="density believed (kg/m³), with two standard deviations",
        xlim=(0.0, 1.45 * max(float(np.max([kind.density + 2.0 * kind.sd for kind in kinds])), 1.0)),
    )
    axes.set_title(title, fontsize=FONT_SIZE)
    tidy(axes)
    return figure
