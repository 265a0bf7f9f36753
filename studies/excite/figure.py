"""Figures of the study of how to move."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.reporting.figures import LINE_STYLES, MARKERS, OBJECT_COLOURS, tidy


def draw_errors(
    places: tuple[float, ...],
    panels: Mapping[str, Mapping[str, Mapping[str, Any]]],
    *,
    found: str,
    said: str,
    label: str,
) -> Figure:
    """Draws errors that were found (lines) and stated (thin lines) by rule, a panel each.

    Args:
        places: Numbers of postures, or lengths of motions; of some rules the first of them.
        panels: Numbers by rule, by title of the panel.
        found: Key of the root mean square errors.
        said: Key of the stated standard deviations.
        label: Label of the horizontal axis.
    """
    figure = Figure(figsize=(5.5 * len(panels), 4.5), layout="constrained")
    all_axes = np.atleast_1d(figure.subplots(1, len(panels)))
    for axes, (title, rules) in zip(all_axes, panels.items(), strict=True):
        for k, (name, each) in enumerate(rules.items()):
            style: dict[str, Any] = {"color": OBJECT_COLOURS[k], "linestyle": LINE_STYLES[k % len(LINE_STYLES)]}
            marker = MARKERS[k % len(MARKERS)]
            axes.loglog(places[: len(each[found])], each[found], marker=marker, label=name.replace("_", " "), **style)
            axes.loglog(places[: len(each[said])], each[said], linewidth=0.7, **style)
        axes.set_title(title)
        axes.set_xlabel(label)
        axes.set_ylabel("error of the mass (g); thin: stated")
    all_axes[0].legend(frameon=False)
    tidy(*all_axes)
    return figure
