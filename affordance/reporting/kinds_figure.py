"""Figure of the memory of a learner with kinds."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from affordance.belief.kinds_summary import KindSummary
from affordance.reporting.figures import FONT_SIZE, tidy

_LINE = "#000000"


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
        axes.barh(row, width, left=kind.density - 2.0 * kind.sd, color=kind.colour, edgecolor=_LINE, height=0.7)
        axes.plot([kind.density, kind.density], [row - 0.35, row + 0.35], color=_LINE, linewidth=1.4)
        ticks.append(row)
        most = ", most populous" if kind.is_most_populous else ""
        labels.append(f"kind {number}{most}\n{kind.density:.0f} ± {kind.sd:.0f} kg/m³")
        for known in kind.objects:
            row += 1.0
            face = kind.colour if known.has_own else "none"
            spread = 2.0 * known.sd if known.has_own else 0.0
            error = spread or None
            axes.errorbar(known.density, row, xerr=error, fmt="o", color=_LINE, markerfacecolor=face, capsize=2.0)
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
