"""Figures of the fit of kappa to human data, and of a decoy held again."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.reporting.figures import FONT_SIZE, LINE_STYLES, OBJECT_COLOURS, tidy
from affordance.reporting.statistics import Estimate

_PEOPLE, _NEUTRAL = "#000000", "#777777"
# Most observers that are drawn one by one.
_MOST_DRAWN = 30


class Interval(NamedTuple):
    """Published mean with its 95 % interval."""

    mean: float
    low: float
    high: float


def draw_kappa_fit(
    curves: Mapping[str, tuple[Array, Array]],
    people: Sequence[Interval],
    profile: tuple[Array, Array],
    *,
    kappas: Array,
    best: Interval,
    threshold: float,
    title: str,
) -> Figure:
    """Draws the learned fraction over kappa in each group, and the likelihood of kappa.

    Args:
        curves: Learned fraction and its standard error by group, (K,) each.
        people: Learned fraction of people by group, in the same order.
        profile: Values of kappa, and log likelihood relative to its maximum, (N,) each.
        kappas: Values that were simulated, (K,).
        best: Maximum-likelihood kappa and its interval.
        threshold: Relative log likelihood at the ends of the interval, below zero.
        title: Title of the figure.
    """
    figure = Figure(figsize=(9.0, 3.9))
    left, right = figure.subplots(1, 2)
    for (label, (mean, se)), found, colour in zip(curves.items(), people, OBJECT_COLOURS, strict=False):
        left.errorbar(kappas, mean, 1.96 * se, fmt="o-", color=colour, markersize=4.0, capsize=2.0, label=label)
        left.axhline(found.mean, color=colour, linewidth=1.0, linestyle="--")
        left.axhspan(found.low, found.high, color=colour, alpha=0.12, linewidth=0.0)
    left.axvspan(best.low, best.high, color="#888888", alpha=0.15, linewidth=0.0)
    left.set_xlabel("kappa, breadth of a category over its mean")
    left.set_ylabel("learned fraction f")
    left.set_title("Simulated; people dashed, with 95 % interval", fontsize=FONT_SIZE)
    left.legend(frameon=False)
    right.plot(*profile, color=_PEOPLE, linewidth=1.6)
    right.axhline(threshold, color=_PEOPLE, linewidth=0.8, linestyle=":")
    right.axvline(best.mean, color=_PEOPLE, linewidth=0.8, linestyle="--")
    right.axvspan(best.low, best.high, color="#888888", alpha=0.15, linewidth=0.0)
    right.set_ylim(max(-8.0, float(profile[1].min()) - 0.5), 0.5)
    right.set_xlabel("kappa")
    right.set_ylabel("log likelihood less its largest value")
    right.set_title(f"kappa = {best.mean:.3f}, 95 % interval {best.low:.3f} to {best.high:.3f}", fontsize=FONT_SIZE)
    figure.suptitle(title, fontsize=FONT_SIZE + 1)
    tidy(left, right)
    return figure


def draw_decoy_again(
    lifts: Mapping[str, Estimate], densities: Mapping[str, Array], *, density_true: float, labels: Sequence[str]
) -> Figure:
    """Draws the excursion of objects in repeated holds, and the density belief about their material, by learner.

    Args:
        lifts: Largest excursion of the object, up or down, in each of K holds, by learner, (K,) each, [m].
        densities: Median density belief before the first and after each hold, (K + 1,) each, [kg/m^3].
        density_true: True density of the material, [kg/m^3].
        labels: Names of the K held objects.
    """
    figure = Figure(figsize=(11.0, 4.2))
    left, right = figure.subplots(1, 2)
    positions = np.arange(1, len(labels) + 1)
    offset = 0.14
    for k, ((name, height), colour) in enumerate(zip(lifts.items(), OBJECT_COLOURS, strict=False)):
        error = 100.0 * np.array([height.mean - height.low, height.high - height.mean])
        shifted = positions + offset * (k - 0.5 * (len(lifts) - 1))
        left.errorbar(shifted, 100.0 * height.mean, error, fmt="o", color=colour, capsize=2.5, label=name)
        style = f"o{LINE_STYLES[k % len(LINE_STYLES)]}"
        right.plot([0, *positions], densities[name], style, color=colour, markersize=4.0, label=name)
    left.axhline(0.0, color=_PEOPLE, linewidth=0.8, linestyle=":")
    right.axhline(density_true, color=_PEOPLE, linewidth=1.0, linestyle=":", label="true")
    for axes in (left, right):
        axes.set_xticks(positions, labels, rotation=40, ha="right")
    left.set_ylabel("farthest height of the object (cm)")
    left.set_title("Mean over observers, 95 % interval", fontsize=FONT_SIZE)
    right.set_ylabel("density believed of the material (kg/m³)")
    right.set_title("After each hold, median over observers", fontsize=FONT_SIZE)
    right.set_ylim(bottom=0.0)
    right.legend(frameon=False)
    tidy(left, right)
    return figure
