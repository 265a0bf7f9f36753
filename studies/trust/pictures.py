"""Figures of the studies of ``make trust``."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from scipy.stats import binom

from affordance.reporting.figures import OBJECT_COLOURS, tidy
from studies.trust.calibration import COVERAGES, NUM_BINS, Calibration
from studies.trust.soak import DURATION, NUM_BLOCKS, Soak

# Probability that a bin of a calibrated rank histogram lies within the band.
_BAND = 0.99
_FONT_SIZE = 9


def draw_ranks(calibrations: Mapping[str, Calibration], names: Sequence[str]) -> Figure:
    """Plots histograms of the ranks of true densities in posteriors, with the band of a uniform distribution."""
    figure = Figure(figsize=(12.0, 3.0 * ((len(calibrations) + 2) // 3)))
    all_axes = figure.subplots((len(calibrations) + 2) // 3, 3, sharex=True, sharey=True)
    for axes, (name, found) in zip(all_axes.flat, calibrations.items(), strict=False):
        count = len(found.positions)
        low, high = (binom.ppf(0.5 + side * 0.5 * _BAND, count, 1.0 / NUM_BINS) for side in (-1.0, 1.0))
        axes.axhspan(low, high, color="#dddddd", zorder=0)
        axes.axhline(count / NUM_BINS, color="#000000", linewidth=0.8, linestyle=":")
        for k, positions in enumerate(found.positions.T):
            heights, edges = np.histogram(positions, NUM_BINS, (0.0, 1.0))
            axes.stairs(heights, edges, color=OBJECT_COLOURS[k], linewidth=1.4, label=names[k])
        said, covered = (
            ", ".join(f"{100 * share:.{digits}f}" for share in shares)
            for shares, digits in ((COVERAGES, 0), (found.coverage, 1))
        )
        axes.set_title(f"{name}\ncorrected p = {found.p_value:.2g}; {said} % cover {covered}", fontsize=_FONT_SIZE)
        tidy(axes)
    for axes in all_axes[-1]:
        axes.set_xlabel("rank of the true density in the posterior")
    for row in all_axes:
        row[0].set_ylabel("draws")
    all_axes.flat[0].legend(frameon=False, fontsize=_FONT_SIZE, title=f"grey: {100 * _BAND:.0f} % of uniform ranks")
    return figure


def draw_faults(costs: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Plots the effect of each fault on beliefs and choices after each trial."""
    names = list(costs)
    figure = Figure(figsize=(10.0, 0.8 + 0.32 * len(names)))
    left, right = figure.subplots(1, 2, sharey=True)
    rows = np.arange(len(names))
    left.plot([100.0 * cost["density_error"] for cost in costs.values()], rows, "o", color=OBJECT_COLOURS[0])
    left.set_xlabel("error of believed densities after six trials (%)")
    left.set_xlim(left=0.0)
    for moment, marker, label in ((1, "s", "after one trial"), (-1, "o", "after six trials")):
        shares = [100.0 * cost["p_correct"][moment] for cost in costs.values()]
        right.plot(shares, rows, marker, color=OBJECT_COLOURS[1 if moment == 1 else 2], label=label)
    right.set(xlabel="correct choices of a grip (%)", xlim=(0.0, 103.0))
    right.legend(frameon=False, fontsize=_FONT_SIZE, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    left.set_yticks(rows, names)
    left.invert_yaxis()
    for axes in (left, right):
        axes.grid(axis="y", color="#dddddd", linewidth=0.8)
        axes.set_axisbelow(True)
        tidy(axes)
    return figure


def draw_soak(found: Soak, trials: int) -> Figure:
    """Plots memory and time of a trial against the number of trials in one process."""
    figure = Figure(figsize=(9.0, 3.2))
    left, right = figure.subplots(1, 2)
    done = trials // NUM_BLOCKS * np.arange(1, NUM_BLOCKS + 1)
    left.plot(done, found.memory, "o-", color=OBJECT_COLOURS[0], markersize=4.0)
    left.set(ylabel="memory of the process (MB)", ylim=(0.0, 1.2 * found.memory.max()))
    right.plot(done, 1e3 * found.seconds, "o-", color=OBJECT_COLOURS[2], markersize=4.0)
    right.set(ylabel=f"processor time of a trial of {DURATION:g} s (ms)", ylim=(0.0, 1.2e3 * found.seconds.max()))
    for axes in (left, right):
        axes.set_xlabel("trials in one process")
        tidy(axes)
    return figure


def draw_scaling(curves: Mapping[str, tuple[Sequence[int], Sequence[float]]], efficiency: float) -> Figure:
    """Plots time against count for each curve, with a line of times proportional to the count."""
    figure = Figure(figsize=(12.0, 3.4))
    all_axes = figure.subplots(1, len(curves))
    for axes, (name, (counts, seconds)) in zip(all_axes, curves.items(), strict=True):
        axes.loglog(counts, seconds, "o-", color=OBJECT_COLOURS[0], label="measured")
        proportional = np.asarray(counts) * seconds[-1] / counts[-1]
        axes.loglog(counts, proportional, ":", color="#000000", label="proportional")
        what, of = name.split(": ", 1)
        axes.set_xticks(counts, [f"{count:,}" for count in counts])
        axes.minorticks_off()
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_xlabel(what)
        axes.set_title(of, fontsize=_FONT_SIZE)
        tidy(axes)
    all_axes[0].set_ylabel("seconds")
    all_axes[0].legend(frameon=False, fontsize=_FONT_SIZE)
    figure.suptitle(f"How the cost grows; two processes are {2 * efficiency:.2f} times as fast as one", fontsize=10)
    return figure
