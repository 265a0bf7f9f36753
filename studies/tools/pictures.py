"""Pictures of what vision detects of real tools (object, colours and columns), and the paper's figure 1."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from affordance.objects.array_solids import ColumnSolid
from affordance.objects.tool import Tool
from affordance.reporting.figures import OBJECT_COLOURS, save_figure, tidy
from affordance.vision.pixels.camera_sensor import CameraSensor, get_turning_stand, present
from affordance.vision.pixels.columns import build_columns
from affordance.vision.pixels.seen_tool import detect_tool
from studies.tools.seen import render_labels
from studies.tools.study import ToolsResult
from studies.tools.uncommon import CheckedMass, CheckedMotion

_MM = 1e3
# Side of a cell in the picture of columns, [mm]; a cell shows the mean thickness of its columns.
_CELL_MM = 1.0
# Margin around an object in its picture, [pixels].
_ROOM = 25


def save_pictures(result: ToolsResult, folder: Path) -> None:
    """Draws all pictures of the study into a folder."""
    tools = [*result.choices["own"].tools, *result.uncommon.tools]
    stand = get_turning_stand()
    save_figure(draw_seen(tools, stand, result.config.seed), folder, "seen")
    save_figure(draw_uncommon(result, stand), folder, "uncommon")


def draw_seen(tools: Sequence[Tool], stand: CameraSensor, seed: int) -> Figure:
    """Draws for each tool one of its pictures, the colours detected in it, and the height of its columns."""
    figure = Figure(figsize=(11.0, 1.9 * len(tools)))
    table = figure.subplots(len(tools), 3, squeeze=False, width_ratios=(1.0, 1.0, 1.25))
    for row, tool in zip(table, tools, strict=True):
        photographs = stand.take_pictures(tool, np.random.default_rng([seed, *tool.name.encode()]))
        seen = detect_tool(photographs, stand.rig, stand.noise)
        view = seen.views[0]
        column, line = view.surface.corner.astype(int)
        height, width = view.labels.shape
        window = photographs[0].picture.colour[line : line + height, column : column + width]
        row[0].imshow(window)
        row[0].set_title(f"{tool.name}: one of two pictures", fontsize=9)
        found = np.ones((height, width, 3))
        for number, look in enumerate(seen.looks):
            found[view.labels == number] = look.colour
        row[1].imshow(found)
        count = len(seen.looks)
        row[1].set_title(f"{count} colour{'s' if count > 1 else ''} in full light", fontsize=9)
        _draw_columns(row[2], list(build_columns(*seen.views).values()))
    for axes in table[:, :2].ravel():
        axes.axis("off")
    return figure


def _draw_columns(axes: Axes, solids: Sequence[ColumnSolid]) -> None:
    places = _MM * np.concatenate([solid.places for solid in solids])
    thickness = _MM * np.concatenate([np.ptp(solid.ends, axis=1) for solid in solids])
    low, high = places.min(axis=0), places.max(axis=0)
    cells = np.ceil((high - low) / _CELL_MM).astype(int) + 1
    columns, lines = np.floor((places - low) / _CELL_MM).astype(int).T
    total, count = np.zeros(cells[::-1]), np.zeros(cells[::-1])
    np.add.at(total, (lines, columns), thickness)
    np.add.at(count, (lines, columns), 1.0)
    mean = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0.0)
    marks = axes.imshow(mean, origin="lower", cmap="viridis")
    axes.axis("off")
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(marks, ax=axes, label="thickness (mm)", shrink=0.8)
    axes.set_title("columns between both sides", fontsize=9)


def draw_uncommon(result: ToolsResult, stand: CameraSensor) -> Figure:
    """Draws the paper's figure 1: the two objects, their masses as seen and as held, and the work of the motions."""
    tools, motions, masses = result.uncommon
    figure = Figure(figsize=(11.0, 5.6))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 1.2))
    for number, tool in enumerate(tools):
        axes = figure.add_subplot(grid[0, number])
        rows, columns = np.nonzero(render_labels(present(tool)[0], stand.rig) >= 0)
        axes.imshow(
            stand.render(present(tool)[0]).colour[
                rows.min() - _ROOM : rows.max() + _ROOM, columns.min() - _ROOM : columns.max() + _ROOM
            ]
        )
        axes.set_title(f"{tool.name} ({tool.mass:.2f} kg)", fontsize=10)
        axes.axis("off")
    left, right = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    _draw_uncommon_masses(left, masses)
    _draw_motions(right, motions)
    tidy(left, right)
    return figure


def draw_intervals(
    axes: Axes, places: ArrayLike, percentiles: ArrayLike, colour: str, label: str | None, **style: Any
) -> None:
    """Draws percentiles, (N, 3), over places: a mark for the middle one, and a bar between the other two."""
    low, middle, high = np.transpose(percentiles)
    axes.errorbar(places, middle, [middle - low, high - middle], fmt="o", color=colour, label=label, **style)


def _draw_uncommon_masses(axes: Axes, masses: Sequence[CheckedMass]) -> None:
    for place, mass in enumerate(masses):
        for offset, label, interval, colour in (
            (-0.15, "seen", mass.seen, OBJECT_COLOURS[0]),
            (0.15, "held", mass.held, OBJECT_COLOURS[1]),
        ):
            draw_intervals(axes, [place + offset], [interval], colour, label if place == 0 else None, capsize=3.0)
        axes.plot([place - 0.3, place + 0.3], [mass.mass] * 2, color="#000000", label=None if place else "true")
    axes.set_xticks(range(len(masses)), [mass.object_name for mass in masses])
    axes.set_xlim(-0.6, len(masses) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("mass (kg)")
    axes.set_title("believed from two pictures, and after one hold; 90 % intervals", fontsize=10)
    axes.legend(frameon=False, fontsize=8)


def _draw_motions(axes: Axes, motions: Sequence[CheckedMotion]) -> None:
    for place, motion in enumerate(motions):
        if np.isfinite(motion.work).all():
            label = "predicted from two pictures" if place == 0 else None
            draw_intervals(axes, [place], [motion.work], OBJECT_COLOURS[0], label, capsize=3.0)
        label = "simulated with the true object" if place == 0 else None
        axes.plot([place], [motion.simulated], "x", color=OBJECT_COLOURS[2], markersize=9.0, label=label)
    names = [f"{each.object_name}\nby {each.grip}\np = {each.p_best:.2f}" for each in motions]
    axes.set_xticks(range(len(motions)), names, fontsize=8)
    axes.set_ylabel("work of mashing (J)")
    axes.set_title("options, best first", fontsize=10)
    axes.legend(frameon=False, fontsize=8)
