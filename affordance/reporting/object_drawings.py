"""Draws the objects of a tools file in side view."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Patch, Polygon
from scipy.spatial import ConvexHull

from affordance.arrays import Array
from affordance.objects.array_solids import TriangleMesh
from affordance.objects.colour import Colour
from affordance.objects.inertia import Ellipsoid, find_visible
from affordance.objects.tool import Component, Tool
from affordance.reporting.figures import count_columns
from affordance.reporting.formatting import fold, label

_METRES_TO_CM = 100.0
_SCALE_BAR = 10.0  # [cm]
_TITLE_WIDTH = 60  # width of an object's title, [characters]
_TITLE = 0.35  # height of a title, [inches]
_HAND = 0.022  # radius of the drawn hand, [m]
_LINE = 0.8  # width of outlines
# Number of directions in which the outline of a convex solid is sampled. The offset, [rad], keeps all of them away
# from the normals of an axis-aligned box.
_DIRECTIONS, _OFF_AXIS = 256, 1e-3
_MANY = 5000  # a mesh with more triangles is rasterised
_APART = 1e-3  # smallest distance between drawn expected and true centres of mass, [m]
_EXPECTED: dict[str, Any] = {
    **{"marker": "o", "linestyle": "none", "markersize": 10.0, "markeredgewidth": 2.2},
    **{"markerfacecolor": "none", "markeredgecolor": "#000000"},
}


class Drawing(NamedTuple):
    """Object to be drawn in its visible colours, or in the colours of its true materials (``as_made``).

    For a decoy, the expected centre of mass is also drawn. It is computed from the apparent materials.
    """

    tool: Tool
    title: str
    as_made: bool = False


def draw_objects(drawings: Sequence[Drawing], *, columns: int = 1) -> Figure:
    """Draws objects at a common scale, each with the hand and the object's true centre of mass."""
    rows = [drawings[first : first + columns] for first in range(0, len(drawings), columns)]
    limits = [compute_limits([drawing.tool for drawing in row]) for row in rows]
    limits[-1][0][1] -= 2.0  # room for the scale bar
    left, right = min(low[0] for low, _ in limits), max(high[0] for _, high in limits)
    tall = np.array([high[1] - low[1] for low, high in limits])
    # Objects are about 4.5 inches wide, or narrower if they are tall. Titles need 3.6 inches.
    scale = min(4.5 / (right - left), 2.5 / tall.max())
    width = max(3.6, scale * (right - left))
    figure = Figure(figsize=(width * columns, float(np.sum(scale * tall + _TITLE)) + 0.5))
    grid = figure.add_gridspec(len(rows), columns, height_ratios=scale * tall + _TITLE)
    for row, ((low, high), drawn) in enumerate(zip(limits, rows, strict=True)):
        for column, drawing in enumerate(drawn):
            last = figure.add_subplot(grid[row, column], aspect="equal", xlim=(left, right), ylim=(low[1], high[1]))
            last.axis("off")
            draw_object(last, drawing)
    below = limits[-1][0][1] + 0.5
    last.plot([right - _SCALE_BAR, right], [below, below], color="#000000", linewidth=2.0, solid_capstyle="butt")
    last.annotate(
        f"{_SCALE_BAR:.0f} cm", (right - 0.5 * _SCALE_BAR, below), (0, 3), textcoords="offset points", ha="center"
    )
    handles = last.plot([], [], "x", color="#000000", markersize=9.0, markeredgewidth=2.0, label="centre of mass")
    if any(_compute_expected_centre(drawing.tool) is not None for drawing in drawings):
        handles += last.plot([], [], **_EXPECTED, label="expected centre")
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


def compute_limits(tools: Sequence[Tool]) -> tuple[Array, Array]:
    """Computes the limits of x and y of tools and hands, with a margin, [cm]."""
    corners = [np.array([[-2.0 * _HAND, -_HAND], [0.0, _HAND]])]
    for tool in tools:
        for part in tool.components:
            for axis in np.vstack([np.eye(3)[:2], -np.eye(3)[:2]]):
                R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
                corners.append((p_TE + R_TE @ part.shape.find_support(R_TE.T @ axis))[None, :2])
    places = _METRES_TO_CM * np.concatenate(corners)
    return places.min(axis=0) - 0.5, places.max(axis=0) + 0.5


def _outline_ellipsoid(part: Component) -> Patch:
    """Computes an ellipsoid's outline along Tz: the ellipse of the upper left block of R diag(a^2) R^T."""
    R_TE = part.X_TE[:3, :3]
    shadow = (R_TE * part.shape.sizes**2) @ R_TE.T
    squares, directions = np.linalg.eigh(shadow[:2, :2])
    width, height = 2.0 * _METRES_TO_CM * np.sqrt(squares)
    angle = float(np.degrees(np.arctan2(directions[1, 0], directions[0, 0])))
    x, y = (float(value) for value in _METRES_TO_CM * part.X_TE[:2, 3])
    return Ellipse((x, y), float(width), float(height), angle=angle)


def _outline_solid(part: Component) -> Patch:
    """Computes the outline of a convex solid seen along Tz, which is the convex hull of its support points."""
    R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
    turns = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False) + _OFF_AXIS
    points = [
        p_TE + R_TE @ part.shape.find_support(R_TE.T @ np.array([np.cos(turn), np.sin(turn), 0.0])) for turn in turns
    ]
    places = _METRES_TO_CM * np.array(points)[:, :2]
    return Polygon(places[ConvexHull(places, qhull_options="QJ").vertices], closed=True)


def _draw_mesh(axes: Axes, mesh: TriangleMesh, X_TE: Array, colour: Colour) -> None:
    """Draws a mesh as seen along Tz, so that dents, holes and silhouette edges are visible."""
    corners = _METRES_TO_CM * (mesh.vertices @ X_TE[:3, :3].T + X_TE[:3, 3])[:, :2]
    triangles = corners[mesh.faces]
    many = len(triangles) > _MANY
    fill = PolyCollection(list(triangles), facecolor=colour, edgecolor=colour, linewidth=0.2, rasterized=many)
    one, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    towards = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0] > 0.0
    edges = np.sort(np.vstack([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    counts = np.bincount(index.ravel(), weights=np.tile(towards, 3))
    sides = np.bincount(index.ravel())
    outline = LineCollection(list(corners[unique[(counts > 0) & (counts < sides)]]), color="#000000", linewidth=_LINE)
    for collection in (fill, outline):
        axes.add_collection(collection, autolim=False)


def _compute_expected_centre(tool: Tool) -> Array | None:
    """Computes the centre of mass of a tool's apparent materials. Returns None if it is close to the true centre."""
    parts = tuple(replace(part, material=part.looks_like) for part in tool.components)
    seeming = replace(tool, components=parts)
    return None if np.linalg.norm(seeming.p_TTcm - tool.p_TTcm) < _APART else seeming.p_TTcm


def draw_object(axes: Axes, drawing: Drawing) -> None:
    """Draws an object as seen along Tz, [cm], with the hand and the object's true centre of mass."""
    tool = drawing.tool
    for part in tool.components:
        colour = (part.material if drawing.as_made else part.looks_like).colour
        if isinstance(shape := find_visible(part.shape), TriangleMesh):
            _draw_mesh(axes, shape, part.X_TE, colour)
        else:
            outline = _outline_ellipsoid(part) if isinstance(part.shape, Ellipsoid) else _outline_solid(part)
            outline.set(facecolor=colour, edgecolor="#000000", linewidth=_LINE)
            axes.add_patch(outline)
    hand = _METRES_TO_CM * _HAND
    axes.add_patch(Circle((-hand, 0.0), hand, facecolor="#DDDDDD", edgecolor="#666666"))
    x, y, _ = _METRES_TO_CM * tool.p_TTcm
    if (expected := _compute_expected_centre(tool)) is not None:
        axes.plot(
            *(_METRES_TO_CM * expected[:2]), **_EXPECTED | {"markeredgewidth": 5.0, "markeredgecolor": "#FFFFFF"}
        )
        axes.plot(*(_METRES_TO_CM * expected[:2]), **_EXPECTED)
    axes.plot(x, y, "x", color="#FFFFFF", markersize=12.0, markeredgewidth=4.5)
    axes.plot(x, y, "x", color="#000000", markersize=11.0, markeredgewidth=2.2)
    axes.set_title(fold(f"{drawing.title} ({tool.mass:.2f} kg)", _TITLE_WIDTH), fontsize=10)
