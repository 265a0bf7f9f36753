"""Pictures of objects as seen from the side, drawn from the tools themselves."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse

from affordance.arrays import Array
from affordance.objects.tool import Tool
from affordance.reporting.figures import count_columns
from affordance.reporting.formatting import fold, label

_METRES_TO_CM = 100.0
_SCALE_BAR = 10.0  # [cm]
_TITLE_WIDTH = 60  # of one object, in letters
_HAND = 0.022  # radius it is drawn with, [m]


class Drawing(NamedTuple):
    """An object in a picture.

    Attributes:
        tool: The object as it is held.
        title: Stands above it.
        as_made: Whether it is drawn in the colours of what it is made of, rather than in those it shows.
    """

    tool: Tool
    title: str
    as_made: bool = False


def draw_objects(drawings: Sequence[Drawing], *, columns: int = 1) -> Figure:
    """Draws objects at one scale, each with its hand and its true centre of mass.

    Args:
        drawings: The objects.
        columns: How many stand side by side.
    """
    rows = -(-len(drawings) // columns)
    figure = Figure(figsize=(6.2 * columns, 1.5 * rows + 0.7))
    all_axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    low, high = _find_limits([drawing.tool for drawing in drawings])
    for axes, drawing in zip(all_axes, drawings, strict=False):
        _draw_object(axes, drawing)
    for axes in all_axes:
        axes.set_aspect("equal")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1] - 2.0, high[1])
        axes.axis("off")
    right, below = high[0], low[1] - 1.5
    last = all_axes[len(drawings) - 1]
    last.plot([right - _SCALE_BAR, right], [below, below], color="#000000", linewidth=2.0, solid_capstyle="butt")
    last.annotate(
        f"{_SCALE_BAR:.0f} cm", (right - 0.5 * _SCALE_BAR, below), (0, 3), textcoords="offset points", ha="center"
    )
    handles = last.plot([], [], "x", color="#000000", markersize=9.0, markeredgewidth=2.0, label="centre of mass")
    colours = {}
    for drawing in drawings:
        for part in drawing.tool.components:
            material = part.material if drawing.as_made else part.looks_like
            colours[material.name] = material.colour
    for name, colour in colours.items():
        handles += last.plot([], [], "o", color=colour, markeredgecolor="#000000", markersize=9.0, label=label(name))
    handles += last.plot([], [], "o", color="#DDDDDD", markeredgecolor="#666666", markersize=9.0, label="hand")
    figure.legend(
        handles=handles,
        frameon=False,
        loc="outside lower center",
        ncols=count_columns([str(each.get_label()) for each in handles]),
    )
    return figure


def _find_limits(tools: Sequence[Tool]) -> tuple[Array, Array]:
    """Least and largest x and y that tools and hands reach, and a little more, [cm]."""
    corners = [np.array([[-2.0 * _HAND, -_HAND], [0.0, _HAND]])]
    for tool in tools:
        for part in tool.components:
            for axis in np.vstack([np.eye(3)[:2], -np.eye(3)[:2]]):
                R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
                corners.append((p_TE + R_TE @ part.shape.find_support(R_TE.T @ axis))[None, :2])
    places = _METRES_TO_CM * np.concatenate(corners)
    return places.min(axis=0) - 0.5, places.max(axis=0) + 0.5


def _draw_object(axes: Axes, drawing: Drawing) -> None:
    tool = drawing.tool
    for part in tool.components:
        # What a solid ellipsoid shows along Tz is the ellipse of the upper left block of R diag(a^2) R^T.
        R_TE = part.X_TE[:3, :3]
        shadow = (R_TE * part.shape.sizes**2) @ R_TE.T
        squares, directions = np.linalg.eigh(shadow[:2, :2])
        width, height = 2.0 * _METRES_TO_CM * np.sqrt(squares)
        angle = float(np.degrees(np.arctan2(directions[1, 0], directions[0, 0])))
        colour = (part.material if drawing.as_made else part.looks_like).colour
        centre = _METRES_TO_CM * part.X_TE[:2, 3]
        axes.add_patch(
            Ellipse(
                (float(centre[0]), float(centre[1])),
                float(width),
                float(height),
                angle=angle,
                facecolor=colour,
                edgecolor="#000000",
                linewidth=0.8,
            )
        )
    hand = _METRES_TO_CM * _HAND
    axes.add_patch(Circle((-hand, 0.0), hand, facecolor="#DDDDDD", edgecolor="#666666"))
    x, y, _ = _METRES_TO_CM * tool.p_TTcm
    axes.plot(x, y, "x", color="#FFFFFF", markersize=12.0, markeredgewidth=4.5)
    axes.plot(x, y, "x", color="#000000", markersize=11.0, markeredgewidth=2.2)
    axes.set_title(fold(f"{drawing.title} ({tool.mass:.2f} kg)", _TITLE_WIDTH), fontsize=10)
