"""Map of the grip that needs less work for hammering."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import name_object
from affordance.objects.tool import Tool
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, mix_colour
from affordance.reporting.formatting import fold, label
from studies.hammering.work_map import HammeringMap

# Colours of the two grips.
_GRIP_COLOURS = (OBJECT_COLOURS[0], OBJECT_COLOURS[2])
# Ticks of a colour bar of ratios, as far as it extends, and its least extent.
_RATIOS = np.array([1.1, 1.2, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0])
_LEAST_RATIO = 1.2
# Characters per line of a legend within a figure, and of a title.
_LEGEND_WIDTH = 60
_LINE = 0.16  # height of a line of a name, [inch]
# Fraction of a map's range beyond which a label is placed on the other side of its case.
_ROOM = 0.75
_NOT_FEASIBLE = "#C8C8C8"


def draw_work_map(
    work_map: HammeringMap, densities: Array, tool: Tool, force: float, compared: Sequence[str]
) -> Figure:
    """Draws the cheaper of two grips of a tool over demanded force and density of its denser part."""
    rows = {f"hold by {grip.name}": row for row, grip in enumerate(tool.grips) if grip.name in compared}
    densest = max(tool.components, key=lambda part: part.material.density).material
    return draw_map(
        forces=work_map.forces,
        values=densities,
        work={grip: work_map.work[row] for grip, row in rows.items()},
        feasible={grip: work_map.feasible[row] for grip, row in rows.items()},
        case=(force, densest.density),
        case_label="simulation IV",
        value_label=f"density of the {densest.name} part (kg/m³)",
        title=f"Absolute work of driving the nail with {name_object(tool.name)}",
    )


def draw_map(
    *,
    forces: Array,
    values: Array,
    work: Mapping[str, Array],
    feasible: Mapping[str, NDArray[np.bool_]],
    case: tuple[float, float],
    case_label: str,
    value_label: str,
    title: str,
) -> Figure:
    """Draws a map of which of two grips needs less absolute work, over demanded force and another quantity.

    Forces, (F,), [N], and values of the other quantity, (R,), ascend; work, [J], and feasibility are (R, F) by grip.
    The marked case is a force and a value.
    """
    one, other = work
    can_one, can_other = feasible[one], feasible[other]
    # Log ratio of the other grip's work to the first grip's; positive where the first is cheaper.
    advantage = np.full(can_one.shape, np.nan)
    np.log(np.divide(work[other], work[one], where=can_one & can_other, out=advantage), out=advantage)
    limit = np.log(_LEAST_RATIO)
    if (can_one & can_other).any():
        limit = max(limit, float(np.nanmax(np.abs(advantage))))
    above, below = fold(one), fold(other)
    height = 5.2 + _LINE * (above.count("\n") + below.count("\n"))
    figure = Figure(figsize=(8.0, height), layout="constrained")  # this layout places the colour bar
    axes = figure.subplots()
    colours = _GRIP_COLOURS
    scale = LinearSegmentedColormap.from_list("advantage", [colours[1], "#FFFFFF", colours[0]])
    seen = np.ma.masked_invalid(advantage)
    mesh = axes.pcolormesh(
        forces, values, seen, cmap=scale, vmin=-limit, vmax=limit, shading="nearest", rasterized=True
    )
    handles: list[Artist] = []
    for cells, colour, hatch, name in (
        (can_one & ~can_other, mix_colour(colours[0], 1.0, 0.5), "///", f"only possible: {one}"),
        (can_other & ~can_one, mix_colour(colours[1], 1.0, 0.5), "\\\\\\", f"only possible: {other}"),
        (~can_one & ~can_other, _NOT_FEASIBLE, "", "neither possible"),
    ):
        if cells.any():
            patch = Patch(facecolor=colour, edgecolor="#444444", hatch=hatch, linewidth=0.0, label=label(name))
            _fill(axes, forces, values, cells, patch)
            handles.append(patch)
    if seen.count() and seen.min() < 0.0 < seen.max():
        axes.contour(forces, values, seen, levels=[0.0], colors="#000000", linewidths=1.8)
        handles += axes.plot([], [], color="#000000", linewidth=1.8, label="both need the same absolute work")
    halo = [withStroke(linewidth=3.5, foreground="#FFFFFF")]
    axes.plot(
        *case, "*", color="#000000", markersize=15.0, markeredgecolor="#FFFFFF", markeredgewidth=1.3, zorder=4.0
    )
    right, top = _is_near_the_end(forces, case[0]), _is_near_the_end(values, case[1])
    axes.annotate(
        case_label,
        case,
        xytext=(-9 if right else 9, -7 if top else 7),
        textcoords="offset points",
        ha="right" if right else "left",
        va="top" if top else "baseline",
        fontweight="bold",
        path_effects=halo,
        zorder=4.0,
    )
    axes.set(xlabel="demanded force (N)", ylabel=fold(value_label, 40))
    axes.set_title(fold(title, _LEGEND_WIDTH), fontsize=FONT_SIZE)
    if handles:
        figure.legend(handles=handles, frameon=False, loc="outside lower center", ncols=2)
    bar = figure.colorbar(mesh, ax=axes, fraction=0.06, pad=0.07)
    _mark_ratios(bar, limit)
    bar.ax.set_title(f"{above}\ncheaper", fontsize=9)
    bar.ax.set_xlabel(f"{below}\ncheaper", fontsize=9)
    bar.set_label("absolute work of the more costly grip over the cheaper one's")
    return figure


def _is_near_the_end(values: Array, value: float) -> bool:
    """Returns True if there is no room for a label beyond a value."""
    return bool(value > values[0] + _ROOM * np.ptp(values))


def _fill(axes: Axes, forces: Array, values: Array, cells: NDArray[np.bool_], like: Patch) -> None:
    axes.pcolor(
        forces,
        values,
        np.ma.masked_where(~cells, np.zeros(cells.shape)),
        cmap=LinearSegmentedColormap.from_list("one colour", [like.get_facecolor()] * 2),
        shading="nearest",
        hatch=like.get_hatch(),
        edgecolor="#444444",
        linewidth=0.0,
        label=str(like.get_label()),
        rasterized=True,
    )


def _mark_ratios(bar: Colorbar, limit: float) -> None:
    """Puts at most three ratios on either side of one on a colour bar of log ratios."""
    falling = _RATIOS[np.log(_RATIOS) <= limit][::-1]
    falling = falling[:: -(-len(falling) // 3)]
    ratios = np.concatenate([falling, [1.0], falling[::-1]])
    sides = np.repeat([-1.0, 0.0, 1.0], [len(falling), 1, len(falling)])
    bar.set_ticks((sides * np.log(ratios)).tolist(), labels=[f"{ratio:g}" for ratio in ratios])
