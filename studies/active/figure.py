"""Figure of the study of active choice."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.reporting.figures import LINE_STYLES, MARKERS, OBJECT_COLOURS, tidy


def draw_rules(worlds: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Figure:
    """Plots right choices with 95 % intervals, and regret, against the number of holds; one row for each world."""
    figure = Figure(figsize=(11.0, 4.2 * len(worlds)), layout="constrained")
    rows = figure.subplots(len(worlds), 2, squeeze=False)
    for (right, regret), (world, rules) in zip(rows, worlds.items(), strict=True):
        for k, (name, found) in enumerate(rules.items()):
            share, ends = np.array(found["right"]), np.array(found["right_ci95"])
            places = np.arange(len(share)) + 0.06 * (k - 2)
            style: dict[str, Any] = {
                "color": OBJECT_COLOURS[k],
                "marker": MARKERS[k % len(MARKERS)],
                "linestyle": LINE_STYLES[k % len(LINE_STYLES)],
                "label": name.replace("_", " "),
            }
            right.errorbar(places, share, np.abs(ends.T - share), capsize=2.0, **style)
            regret.plot(places, found["regret_J"], **style)
        right.axhline(0.95, color="0.7", linewidth=0.8)
        right.set(ylim=(0.0, 1.02), ylabel="share of right choices", title=world)
        regret.set_ylabel("regret, sum over all choices (J)")
        regret.set_yscale("symlog", linthresh=0.01)
        for axes in (right, regret):
            axes.set_xlabel("number of objects held before")
    rows[0, 1].legend(frameon=False)
    tidy(*rows.flat)
    return figure
