"""Figures of advice: pictures and costs of options, and worths of holds."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.choice.demand import Criterion
from affordance.choice.ranking import Ranking
from affordance.exceptions import UnavailableError
from affordance.extensions.advice.advice_text import Content
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
_NAME_WIDTH = 22
# Number of rendered options: the best and the second best.
_PICTURES = 2
# Figure of holds: height per row, height of margins, [inch], and characters per line of the title.
_ROW, _REST, _TITLE = 0.35, 1.6, 100


def render_choice(directives: Path, ranking: Ranking, tools: dict[str, Tool]) -> list[Image]:
    """Renders the arm with each of the best options at the start of the task.

    Returns: Pictures; none if no renderer is available.
    """
    shown = ranking.ranked[: min(ranking.num_usable, _PICTURES)]
    gripped = [tools[each.option.object_name].list_gripped()[each.option.grip] for each in shown]
    poses = [Pose(tool, None, each.q_start) for tool, each in zip(gripped, shown, strict=True)]
    try:
        return list(render_poses(directives, poses, width=_WIDTH, height=_HEIGHT))
    except UnavailableError:
        return []


def draw_advice(content: Content, pictures: Sequence[Image]) -> Figure:
    """Plots pictures of the best options, costs, and probabilities of being best."""
    shown = [each for each in content["options"] if each["cost"]["mean"] is not None]
    figure = Figure(figsize=(11.0, max(4.0, 1.6 + 0.45 * len(shown))))
    widths = (*[0.8] * _PICTURES, 1.3, 0.6)
    *of_pictures, of_cost, of_probability = figure.subplots(1, _PICTURES + 2, width_ratios=widths)
    for axes, picture, each in zip(of_pictures, pictures, content["options"], strict=False):
        axes.imshow(picture)
        axes.set_title(_label(each), fontsize=FONT_SIZE)
    for axes in of_pictures:
        axes.axis("off")
    figure.suptitle(fill(content["sentence"], _TITLE), fontsize=FONT_SIZE)
    places = np.arange(float(len(shown)))[::-1]
    colours = [OBJECT_COLOURS[0 if each["usable"] else 2] for each in shown]
    by = Criterion(content["by"])
    scale = 100.0 if by is Criterion.MARGIN else 1.0
    means, *ends = scale * np.array([[each["cost"][key] for each in shown] for key in ("mean", "p05", "p95")])
    _draw_bars(of_cost, places, means, np.abs(np.array(ends) - means), colours)
    of_cost.set_yticks(places, [fold(_label(each), _NAME_WIDTH) for each in shown])
    of_cost.set_xlabel(f"{_LABELS[by]}, mean and 90 % interval")
    of_probability.barh(places, [each["p_best"] for each in shown], color=colours, height=0.6)
    of_probability.set_yticks(places, [""] * len(shown))
    of_probability.set(xlabel="probability of\nbeing best", xlim=(0.0, 1.0), xticks=(0.0, 0.5, 1.0))
    tidy(of_cost, of_probability)
    return figure


def _label(option: Content) -> str:
    name = ", ".join(filter(None, (option["tool"], option["grip"])))
    return name if option["usable"] else f"{name} (not usable)"


def _draw_bars(axes: Axes, places: Array, values: Array, errors: Array, colours: Sequence[str]) -> None:
    axes.barh(places, values, xerr=errors, color=colours, capsize=3.0, height=0.6)


def draw_holds(content: Content) -> Figure:
    """Plots the worth of holding each object, and the probability that the choice is the best after holding it."""
    ranked, places = content["ranked"], np.arange(float(len(content["ranked"])))
    figure = Figure(figsize=(11.0, _REST + _ROW * max(len(ranked), 3)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2.0, 1.0))
    worths, errors = (np.array([each[key] for each in ranked]) for key in ("worth", "worth_se"))
    _draw_bars(left, places, worths, errors, [OBJECT_COLOURS[0]])
    left.set_yticks(places, [each["name"] for each in ranked])
    left.set_xlabel(f"worth ({content['unit']}), with standard error")
    left.set_xlim(left=0.0)
    for k, task in enumerate(content["decisions"]):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        right.axvline(task["p_best"], color=colour, linestyle=":")
        right.plot([each["p_best_after"][k] for each in ranked], places, "o", color=colour, label=task["name"])
    right.set_xlim(0.0, 1.05)
    right.set_xlabel("probability that the choice is best after holding it (dotted: now)")
    right.legend(frameon=False)
    left.invert_yaxis()
    figure.suptitle(fill(content["sentence"], _TITLE))
    tidy(left, right)
    return figure
