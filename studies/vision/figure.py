"""Figure of the study of vision: errors of detected features, and calibration of their stated uncertainty."""

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

from affordance.arrays import Array
from affordance.reporting.figures import MARKERS, OBJECT_COLOURS, tidy


def draw_calibration(*, errors: dict[str, Array], targets: dict[str, float], claimed: Array) -> Figure:
    """Draws errors of detected features, and the calibration of their stated uncertainty.

    Errors are absolute relative ones, and targets their largest admissible medians, by feature; claimed are errors of
    predicted masses, in their stated standard deviations.
    """
    figure = Figure(figsize=(11.0, 4.4))
    left, right = figure.subplots(1, 2)
    for k, (label, values) in enumerate(errors.items()):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        left.plot(100.0 * np.sort(values), np.linspace(0.0, 1.0, len(values)), color=colour, label=label)
        left.plot(100.0 * targets[label], 0.5, MARKERS[k % len(MARKERS)], color=colour)
    left.axhline(0.5, color="#000000", linewidth=0.8, linestyle=":")
    left.plot([], [], MARKERS[0], color="#FFFFFF", markeredgecolor="#000000", label="at most this for the median")
    left.set(
        xscale="log", xlim=(0.01, 100.0), ylim=(0.0, 1.02), xlabel="error at most (%)", ylabel="proportion of cases"
    )
    left.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    levels = np.linspace(0.0, 1.0, 101)[1:-1]
    covered = [(np.abs(claimed) <= norm.ppf(0.5 + 0.5 * level)).mean() for level in levels]
    right.plot(levels, levels, ":", color="#000000", label="exact")
    right.plot(levels, covered, color=OBJECT_COLOURS[0], label=f"predicted mass, {len(claimed)} objects")
    right.plot([0.9, 0.9], [0.85, 0.95], color=OBJECT_COLOURS[2], linewidth=3.0, label="target")
    right.set(xlabel="interval claimed to hold the truth with probability", ylabel="proportion of intervals that do")
    right.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    tidy(left, right)
    return figure
