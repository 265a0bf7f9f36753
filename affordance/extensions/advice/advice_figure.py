"""Figures of advice: costs and torque demands of options, pictures of the best, and the worth of objects to hold."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.choice.demand import Criterion
from affordance.choice.ranking import RankedOption, Ranking
from affordance.exceptions import UnavailableError
from affordance.objects.tool import Tool
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import fold
from affordance.reporting.renderings import Image, Pose, render_poses

_LABELS = {
    Criterion.WORK: "work (J)",
    Criterion.EFFORT: "effort (N² m² s)",
    Criterion.MARGIN: "highest fraction of a torque limit (%)",
    Criterion.GRIP: "wrench at the grip as a force (N)",
}
# Size of the picture, [pixels].
_WIDTH, _HEIGHT = 420, 480
_NAME_WIDTH = 26
# Number of options rendered in the hand: the best, and the second best for comparison.
_PICTURES = 2
# Figure of holds: height of a row and of everything else, [inch], and characters per line of its title.
_ROW, _REST, _TITLE = 0.35, 1.6, 100


def render_choice(directives: Path, advice: Ranking, tools: dict[str, Tool]) -> list[Image]:
    """Renders the arm holding each of the best options at the start of the task; empty if there is no renderer."""
    shown = advice.ranked[: min(advice.num_usable, _PICTURES)]
    gripped = [tools[each.option.object_name].list_gripped()[each.option.grip] for each in shown]
    poses = [Pose(tool, None, each.q_start) for tool, each in zip(gripped, shown, strict=True)]
    try:
        return list(render_poses(directives, poses, width=_WIDTH, height=_HEIGHT))
    except UnavailableError:
        return []


def draw_advice(advice: Ranking, title: str, pictures: Sequence[Image]) -> Figure:
    """Draws a ranking: pictures of the best options, costs with 90 % intervals, and probabilities of being best."""
    shown = [each for each in advice.ranked if np.isfinite(each.amounts.cost.mean)]
    figure = Figure(figsize=(15.0, max(4.0, 1.6 + 0.45 * len(shown))))
    widths = (*[1.0] * _PICTURES, 1.3, 0.6)
    *of_pictures, of_cost, of_probability = figure.subplots(1, _PICTURES + 2, width_ratios=widths)
    for axes, picture, each in zip(of_pictures, pictures, advice.ranked, strict=False):
        axes.imshow(picture)
        axes.set_title(_label(each), fontsize=FONT_SIZE)
    for axes in of_pictures:
        axes.axis("off")
    figure.suptitle(fill(title, _TITLE), fontsize=FONT_SIZE)
    places = np.arange(float(len(shown)))[::-1]
    colours = [OBJECT_COLOURS[2] if each.infeasible_reason else OBJECT_COLOURS[0] for each in shown]
    scale = 100.0 if advice.criterion is Criterion.MARGIN else 1.0
    costs = [each.amounts.cost for each in shown]
    means = scale * np.array([each.mean for each in costs])
    errors = np.abs(scale * np.array([[each.p05, each.p95] for each in costs]).T - means)
    _draw_bars(of_cost, places, means, errors, colours)
    of_cost.set_yticks(places, [fold(_label(each), _NAME_WIDTH) for each in shown])
    of_cost.set_xlabel(f"{_LABELS[advice.criterion]}, mean and 90 % interval")
    of_probability.barh(places, [each.p_best for each in shown], color=colours, height=0.6)
    of_probability.set_yticks(places, [""] * len(shown))
    of_probability.set(xlabel="probability of being best", xlim=(0.0, 1.0))
    tidy(of_cost, of_probability)
    return figure


def _label(ranked: RankedOption) -> str:
    name = ", ".join(filter(None, (ranked.option.object_name, ranked.option.grip)))
    return f"{name} (not usable)" if ranked.infeasible_reason else name


def _draw_bars(axes: Axes, places: Array, values: Array, errors: Array, colours: Sequence[str]) -> None:
    axes.barh(places, values, xerr=errors, color=colours, capsize=3.0, height=0.6)


def draw_holds(
    names: Sequence[str],
    worths: Sequence[tuple[float, float]],
    tasks: Sequence[tuple[str, float, Sequence[float]]],
    *,
    label: str,
    title: str,
) -> Figure:
    """Draws the worth of holding each of K objects, and how it changes the probability of the right choice.

    Args:
        names: Names of the objects.
        worths: Worth of holding each object, and its standard error.
        tasks: For each task its name, the probability that its current choice is right, and that probability after
            holding each object, (K,).
        label: Axis label of the worths, with their unit.
        title: Title of the figure.
    """
    rows = len(names)
    figure = Figure(figsize=(11.0, _REST + _ROW * max(rows, 3)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.0, 1.0))
    places, (values, errors) = np.arange(float(rows)), np.array(worths).reshape(-1, 2).T
    _draw_bars(left, places, values, errors, [OBJECT_COLOURS[0]])
    left.set_yticks(places, names)
    left.set_xlabel(f"{label}, with standard error")
    left.set_xlim(left=0.0)
    for k, (task, now, after) in enumerate(tasks):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        right.axvline(now, color=colour, linestyle=":")
        right.plot(after, places, "o", color=colour, label=task)
    right.set_xlim(0.0, 1.05)
    right.set_xlabel("probability that the choice is best after holding it (dotted: now)")
    right.legend(frameon=False)
    left.invert_yaxis()
    figure.suptitle(fill(title, _TITLE))
    tidy(left, right)
    return figure
