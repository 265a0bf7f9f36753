"""Figure of what may be held next, and what it is worth."""

from matplotlib.figure import Figure

from affordance.choice.next_hold import HoldAdvice
from affordance.reporting.figures import OBJECT_COLOURS, tidy

# Height of a row, and of all else, [inch].
_ROW, _REST = 0.35, 1.4


def draw_holds(advice: HoldAdvice, title: str) -> Figure:
    """Draws the worth of each object with its standard error, and the probability of being right before and after."""
    rows = len(advice.ranked)
    figure = Figure(figsize=(11.0, _REST + _ROW * max(rows, 3)), layout="constrained")
    worth, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.0, 1.0))
    places = range(rows)
    worth.barh(
        places,
        [each.worth for each in advice.ranked],
        xerr=[each.worth_se for each in advice.ranked],
        color=OBJECT_COLOURS[0],
        height=0.6,
        capsize=3.0,
    )
    worth.set_yticks(places, [each.name for each in advice.ranked])
    worth.set_xlabel(f"worth ({advice.unit}), with standard error")
    worth.set_xlim(left=0.0)
    for k, decision in enumerate(advice.decisions):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        right.axvline(decision.p_best, color=colour, linestyle=":")
        after = [each.p_best_after[k] for each in advice.ranked]
        right.plot(after, places, "o", color=colour, label=decision.name)
    right.set_xlim(0.0, 1.05)
    right.set_xlabel("P(best) of the choice then (dotted: now)")
    right.legend(frameon=False)
    worth.invert_yaxis()
    figure.suptitle(title)
    tidy(worth, right)
    return figure
