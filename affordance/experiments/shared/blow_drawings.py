"""Shows blows on a nail as curves, rendered pictures and a slow-motion replay."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.arrays import about
from affordance.objects.tool import Tool
from affordance.plant.nail import NailRecord
from affordance.reporting.figures import FONT_SIZE, LINE_STYLES, OBJECT_COLOURS, darken, tidy
from affordance.reporting.formatting import fold, label
from affordance.reporting.renderings import Pose, render_close_ups, render_poses
from affordance.reporting.replay import Replay, Scene
from affordance.simulation.blow import Blow

TOUCH = np.arange(-0.002, 0.012, 2e-5)  # times around the first contact, [s]; extended while the nail moves
SLOWER, SLOW_BEFORE, SLOW_AFTER = 80.0, 0.01, 0.03  # slow-motion factor; its span before and after the strike, [s]


def label_nails(blows: Sequence[Blow]) -> xr.Dataset:
    """Builds a dataset with forces on the nail and its travel around the strike.

    Args:
        blows: Simulated blows, one per grip.

    Returns:
        ``resistance`` and ``contact``, [N], and ``travel``, [m], over grip and time since the first contact, [s].
    """
    longest = max(blow.nail.time_of_rest - blow.nail.time_of_touch for blow in blows)
    times = np.arange(TOUCH[0], max(TOUCH[-1], longest - TOUCH[0]), TOUCH[1] - TOUCH[0])

    def interpolate(name: str) -> list[Any]:
        return [np.interp(times, b.nail.times - b.nail.time_of_touch, getattr(b.nail, name)) for b in blows]

    axes = ("grip", "time_since_touch")
    return xr.Dataset(
        {
            "resistance": (axes, interpolate("resistance"), about("N", "resistance of the nail")),
            "contact": (axes, interpolate("contact"), about("N", "force of the tool on the nail")),
            "travel": (axes, interpolate("travel"), about("m", "distance by which the nail was driven")),
        },
        {"time_since_touch": (axes[1:], times, about("s", "time since the tool touched the nail"))},
    )


def draw_start_and_strike(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Figure:
    """Renders figure 9: start, strike and nail, with one row per grip."""
    held = tool.list_gripped()
    poses, close = [], []
    for grip, blow in blows.items():
        times, nail = blow.record.times, blow.nail
        row = int(np.argmin(np.abs(times - nail.time_of_touch)))
        start = Pose(held[grip], blow.strike.placement, blow.record.q[0])
        travel = float(np.interp(times[row], nail.times, nail.travel))
        strike = start._replace(q=blow.record.q[row], travel=travel)
        poses += [start, strike]
        close.append(strike)
    images = render_poses(arm, poses, width=1000, height=380)
    close_ups = render_close_ups(arm, close, width=400, height=380)
    rows = {f"held by {grip}": [*images[2 * i : 2 * i + 2], close_ups[i]] for i, grip in enumerate(blows)}
    return draw_renderings(rows, titles=["start", "strike", "the nail at the strike"])


def replay(arm: Path, tool: Tool, blows: Mapping[str, Blow]) -> Replay:
    """Builds the slow-motion replay of the blows, with one scene per grip."""
    held = tool.list_gripped()
    scenes = []
    for grip, blow in blows.items():
        strike, times = blow.strike.time_of_strike, blow.record.times
        scenes.append(
            Scene(
                held[grip],
                times,
                blow.record.q,
                f"held by {grip}: absolute work {blow.work:.1f} J, {blow.force:.0f} N",
                placement=blow.strike.placement,
                travel=np.interp(times, blow.nail.times, blow.nail.travel),
                slow=(strike - SLOW_BEFORE, strike + SLOW_AFTER, SLOWER),
            )
        )
    return Replay(arm, f"Simulation IV: {tool.name}", scenes)


# Colours of the grips.
_GRIP_COLOURS = tuple(OBJECT_COLOURS[i] for i in (0, 2, 1, 3, 4, 5))
_LEGEND_WIDTH = 60
_MILLI = 1e3


def draw_renderings(rows: Mapping[str, Sequence[NDArray[np.uint8]]], *, titles: Sequence[str]) -> Figure:
    """Draws figure 9: one row of pictures per grip.

    Args:
        rows: Pictures, (height, width, 3), by label of the grip. All pictures in a column have the same size.
        titles: Titles of the columns.
    """
    shapes = [picture.shape for picture in next(iter(rows.values()))]
    ratios = [width / height for height, width, _ in shapes]
    height = (12.0 - 0.4) / sum(ratios)
    figure = Figure(figsize=(12.0, height * len(rows) + 0.5))
    grid = figure.subplots(len(rows), len(titles), squeeze=False, width_ratios=ratios)
    for all_axes, (name, pictures) in zip(grid, rows.items(), strict=True):
        for axes, picture in zip(all_axes, pictures, strict=True):
            axes.imshow(picture, interpolation="antialiased")
            axes.set_xticks([])
            axes.set_yticks([])
            axes.spines[:].set_color("#BBBBBB")
        all_axes[0].set_ylabel(fold(name), fontsize=FONT_SIZE + 1)
    for axes, title in zip(grid[0], titles, strict=True):
        axes.set_title(title, fontsize=FONT_SIZE + 1)
    return figure


def draw_blow(records: Mapping[str, NailRecord], *, force_demanded: float) -> Figure:
    """Plots the force on the nail and its travel around the strike for each grip.

    Args:
        records: Records of the nail by grip.
        force_demanded: Required peak force, [N].
    """
    figure = Figure(figsize=(7.2, 5.4))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
    last = 0.0
    for k, (grip, record) in enumerate(records.items()):
        colour, line = _GRIP_COLOURS[k % len(_GRIP_COLOURS)], LINE_STYLES[k % len(LINE_STYLES)]
        times = _MILLI * (record.times - record.time_of_touch)
        last = max(last, _MILLI * (record.time_of_rest - record.time_of_touch))
        name = label(f"resistance of the nail, {grip} (peak {record.resistance.max():.0f} N)", _LEGEND_WIDTH)
        above.plot(times, record.resistance, line, color=colour, linewidth=2.6, label=name)
        name = label(f"contact with the tool, {grip} (peak {record.contact.max():.0f} N)", _LEGEND_WIDTH)
        above.plot(times, record.contact, line, color=darken(colour), linewidth=0.8, label=name, zorder=3.0)
        below.plot(times, _MILLI * record.travel, line, color=colour, linewidth=2.6)
    above.axhline(force_demanded, color="#000000", linestyle=":", label=f"required peak ({force_demanded:.0f} N)")
    above.set_xlim(-0.1 * last, 1.5 * last)
    # For some microseconds after the first contact, the contact force is several times the resistance.
    above.set(ylim=(0.0, 1.9 * force_demanded), ylabel="force (N)")
    below.set(ylabel="travel (mm)", ylim=(0.0, None), xlabel="time from the first touch (ms)")
    cut = any(record.contact.max() > above.get_ylim()[1] for record in records.values())
    remark = "; the contact's peak at the first touch is cut off" if cut else ""
    above.set_title(f"Forces on the nail{remark}", fontsize=FONT_SIZE)
    above.legend(frameon=False, loc="upper right", fontsize=9)
    tidy(above, below)
    return figure
