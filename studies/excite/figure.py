"""Figures of the study of how to move."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator, StrMethodFormatter

from affordance.reporting.figures import LINE_STYLES, MARKERS, OBJECT_COLOURS, tidy

# Names of rules and of arms in figures, by their names in metrics.json.
_NAMES = {
    "stated": "what will be stated",
    "stated_at_once": "what will be stated, body expected before",
    "stated_postures": "what will be stated, postures",
    "random": "random",
    "random_postures": "random postures",
    "condition": "condition number",
    "d_optimal": "D-optimality",
    "panda": "Panda",
    "ur10e": "UR10e",
}


def draw_errors(
    places: tuple[float, ...],
    panels: Mapping[str, Mapping[str, Mapping[str, Any]]],
    *,
    found: str,
    said: str,
    label: str,
) -> Figure:
    """Plots true errors (lines) and stated errors (thin lines) of each rule, one panel for each entry of ``panels``.

    Args:
        places: Numbers of postures, or lengths of motions; a rule with fewer values uses the first of them.
        panels: Numbers of each rule, by panel.
        found: Key of the true error in a rule's numbers.
        said: Key of the stated error.
        label: Label of the horizontal axis.
    """
    figure = Figure(figsize=(5.5 * len(panels), 4.5), layout="constrained")
    all_axes = np.atleast_1d(figure.subplots(1, len(panels)))
    for axes, (title, rules) in zip(all_axes, panels.items(), strict=True):
        for k, (name, each) in enumerate(rules.items()):
            style: dict[str, Any] = {"color": OBJECT_COLOURS[k], "linestyle": LINE_STYLES[k % len(LINE_STYLES)]}
            marker = MARKERS[k % len(MARKERS)]
            axes.loglog(places[: len(each[found])], each[found], marker=marker, label=_NAMES[name], **style)
            axes.loglog(places[: len(each[said])], each[said], linewidth=0.7, **style)
        axes.set_title(_NAMES.get(title, title))
        axes.xaxis.set_major_locator(FixedLocator(places))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set(xlabel=label, ylabel="error of the mass (g); thin: stated")
    all_axes[0].legend(frameon=False)
    tidy(*all_axes)
    return figure
