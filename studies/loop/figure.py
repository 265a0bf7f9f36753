"""Figure of the loop: right choices and regret against experience, by robot."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.reporting.figures import LINE_STYLES, MARKERS, OBJECT_COLOURS, tidy
from studies.loop.lives import LEVELS


def draw_loop(details: Mapping[str, Any]) -> Figure:
    """Plots the share of right choices, with 95 % intervals, and the mean regret for each task and criterion."""
    first = next(iter(details.values()))
    cells = [(task, criterion) for task in first for criterion in first[task]]
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    axes = figure.subplots(2, len(cells), sharex=True, sharey="row", squeeze=False)
    numbers = list(LEVELS.values())
    for column, (task, criterion) in enumerate(cells):
        above, below = axes[:, column]
        for k, (robot, found) in enumerate(details.items()):
            cell = found[task][criterion]
            right = np.array([cell[name]["right"] for name in LEVELS], dtype=float)  # null becomes NaN
            ends = np.array([cell[name]["right_ci95"] for name in LEVELS], dtype=float)
            style = {"color": OBJECT_COLOURS[k], "marker": MARKERS[k % len(MARKERS)], "linestyle": LINE_STYLES[k % 4]}
            places = np.array(numbers) + 0.08 * (k - 1)
            above.errorbar(places, right, np.abs(ends.T - right), label=robot, capsize=2.0, **style)
            regret = np.array([cell[name]["regret"] for name in LEVELS], dtype=float)
            below.plot(places, 100.0 * regret, **style)
        above.set(title=f"{task}, compared by {criterion}", ylim=(0.0, 1.05))
        below.set_xlabel("number of pieces of stock held before")
        below.set_xticks(numbers)
        tidy(above, below)
    axes[0, 0].set_ylabel("share of right choices")
    axes[1, 0].set_ylabel("regret (% of the least cost)")
    axes[0, -1].legend(loc="lower right", frameon=False)
    return figure
