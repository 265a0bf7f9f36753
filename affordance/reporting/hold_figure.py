"""Figure of what may be held next, and what it is worth."""

from collections.abc import Sequence
from textwrap import fill

from matplotlib.figure import Figure

from affordance.reporting.figures import OBJECT_COLOURS, tidy

# Height of a row, and of all else, [inch].
_ROW, _REST = 0.35, 1.6
# Characters of a line of the title.
_TITLE = 100


def draw_holds(
    names: Sequence[str],
    worths: Sequence[tuple[float, float]],
    tasks: Sequence[tuple[str, float, Sequence[float]]],
    *,
    label: str,
    title: str,
) -> Figure:
    """Draws worths, with standard errors, of K named objects, and the probability of being right before and after.

    The label says what worths are, with their unit. Tasks have a name, the probability that their choice is right
    now, and that after holding each object, (K,).
    """
    rows = len(names)
    figure = Figure(figsize=(11.0, _REST + _ROW * max(rows, 3)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.0, 1.0))
    places = range(rows)
    left.barh(
        places,
        [worth for worth, _ in worths],
        xerr=[se for _, se in worths],
        color=OBJECT_COLOURS[0],
        height=0.6,
        capsize=3.0,
    )
    left.set_yticks(places, names)
    left.set_xlabel(f"{label}, with standard error")
    left.set_xlim(left=0.0)
    for k, (task, now, after) in enumerate(tasks):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        right.axvline(now, color=colour, linestyle=":")
        right.plot(after, places, "o", color=colour, label=task)
    right.set_xlim(0.0, 1.05)
    right.set_xlabel("P(best) of the choice then (dotted: now)")
    right.legend(frameon=False)
    left.invert_yaxis()
    figure.suptitle(fill(title, _TITLE))
    tidy(left, right)
    return figure
