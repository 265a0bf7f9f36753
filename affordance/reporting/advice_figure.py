"""Figure of an advice on tools: the tool in the hand, and what each option costs and demands."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.choice.demand import Criterion
from affordance.choice.weighing import Advice, Amount, Weighed
from affordance.exceptions import UnavailableError
from affordance.objects.tool import Tool
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import fold
from affordance.reporting.renderings import Image, Pose, render_poses

_LABELS = {
    Criterion.WORK: "work (J)",
    Criterion.EFFORT: "effort (N² m² s)",
    Criterion.MARGIN: "highest share of a torque limit (%)",
    Criterion.GRIP: "wrench at the grip as a force (N)",
}
# Size of the picture, [pixels].
_WIDTH, _HEIGHT = 420, 480
_NAME_WIDTH = 26


def render_choice(directives: Path, advice: Advice, tools: dict[str, Tool]) -> Image | None:
    """Renders the arm with the chosen tool in its hand at the start of the task; None without a renderer."""
    option = advice.best.option
    tool = tools[option.object_name].list_gripped()[option.grip]
    try:
        return render_poses(directives, [Pose(tool, None, advice.best.q_start)], width=_WIDTH, height=_HEIGHT)[0]
    except UnavailableError:
        return None


def draw_advice(advice: Advice, title: str, picture: Image | None) -> Figure:
    """Draws the picture of the tool in the hand, if any, and bars of cost and torque share with 90 % intervals."""
    shown = [each for each in advice.ranked if np.isfinite(each.cost.mean)]
    figure = Figure(figsize=(12.0, max(4.0, 1.2 + 0.45 * len(shown))))
    of_picture, of_cost, of_probability = figure.subplots(1, 3, width_ratios=(1.0, 1.3, 0.6))
    if picture is not None:
        of_picture.imshow(picture)
    of_picture.axis("off")
    of_picture.set_title(fold(title, 40), fontsize=FONT_SIZE)
    places = np.arange(float(len(shown)))[::-1]
    colours = [OBJECT_COLOURS[2] if each.infeasible_reason else OBJECT_COLOURS[0] for each in shown]
    scale = 100.0 if advice.criterion is Criterion.MARGIN else 1.0
    _draw_bars(of_cost, places, [each.cost for each in shown], colours, scale)
    of_cost.set_yticks(places, [fold(_label(each), _NAME_WIDTH) for each in shown])
    of_cost.set_xlabel(f"{_LABELS[advice.criterion]}, mean and 90 % interval")
    of_probability.barh(places, [each.p_best for each in shown], color=colours, height=0.6)
    of_probability.set_yticks(places, [""] * len(shown))
    of_probability.set(xlabel="P(best)", xlim=(0.0, 1.0))
    tidy(of_cost, of_probability)
    return figure


def _label(weighed: Weighed) -> str:
    return f"{weighed.option.name} (not usable)" if weighed.infeasible_reason else weighed.option.name


def _draw_bars(axes: Axes, places: Array, amounts: list[Amount], colours: list[str], scale: float) -> None:
    means = scale * np.array([each.mean for each in amounts])
    errors = np.abs(scale * np.array([[each.p05, each.p95] for each in amounts]).T - means)
    axes.barh(places, means, xerr=errors, color=colours, capsize=3.0, height=0.6)
