"""Reconstruction of solids as columns between the visible surfaces in two opposite views.

In the frame P of the presented object, Pz points towards the camera of the first view. Both surfaces are sampled on
the same grid of vertical columns. If the ends of a column have different appearances, each gets half of the column.
Open hollows that are visible from other sides are removed.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.rgbd import Camera, Labels
from affordance.extensions.pixels.segmentation import spread_nearest
from affordance.extensions.pixels.surface import Surface
from affordance.objects.array_solids import ColumnSolid

# Distance between columns, which equals the size of a pixel at 0.6 m for an image width of 1280 pixels, [m].
SPACING = 5e-4
# Margin around the visible surface, [m].
_ROOM = 5e-3
# Number of iterations for finding the pixel of a point. They converge where the ray is steeper than the surface.
_STEPS = 12
# Largest distance between the projection of a point and its pixel, [pixels].
_MAX_MISS = 1.5
# Gaps narrower than this are closed, [columns].
_GAP = 5
_UNKNOWN = -1
# Length of the pieces into which columns are divided for removing hollows, [m].
_PIECE = 1e-3
# Thickness of the layer at a surface that is never removed, [m]. These are two pixels, because outlines and averaged
# depths can be wrong by one pixel.
_MARGIN = 1e-3
# Smallest width of a hollow, and width below which pits are filled first, [m]. Averaged depth at an edge includes the
# background and looks like a pit.
_WIDTH, _RIM = 0.01, 4e-3


class View(NamedTuple):
    """View of the object: visible surface, appearance of each pixel, and camera."""

    surface: Surface
    labels: Labels  # index of each pixel's appearance, (height, width), or -1
    camera: Camera
    X_PC: Array  # pose of the camera, (4, 4)


class Sheet(NamedTuple):
    """Visible surface sampled on the grid, (rows, columns)."""

    there: Mask  # True where the object is visible
    height: Array  # [m]
    label: Labels  # index of the appearance


class Side(NamedTuple):
    """Views along Qz in both directions."""

    R_QP: Array  # (3, 3)
    views: tuple[View, View]  # with camera poses in frame Q


def build_columns(above: View, below: View) -> dict[int, ColumnSolid]:
    """Builds the solid of each appearance in frame P from two opposite views, by index of the appearance."""
    x, y, sheets = find_sheets([above, below])
    # The views can disagree at the outline. A column that is visible in only one of them has half the area.
    share = 0.5 * (sheets[0].there.astype(float) + sheets[1].there)
    top, bottom = (spread_nearest(sheet.height, sheet.there) for sheet in sheets)
    labels = [spread_nearest(sheet.label, sheet.there) for sheet in sheets]
    return collect_columns(x, y, share=share, bottom=np.minimum(bottom, top), top=top, labels=labels)


def find_sheets(views: Sequence[View]) -> tuple[Array, Array, list[Sheet]]:
    """Samples the visible surfaces of several views along one axis on a common grid.

    Returns: Coordinates x, (columns,), and y, (rows,), of the grid, [m], and the sampled surface of each view.
    """
    x, y = _lay_grid(views)
    return x, y, [_look_up(view, x, y) for view in views]


def _lay_grid(views: Sequence[View]) -> tuple[Array, Array]:
    """Computes the grid coordinates along Px, (columns,), and Py, (rows,), [m]."""
    points = []
    for view in views:
        rows, columns = np.nonzero(view.surface.mask)
        rays = view.camera.compute_rays(np.column_stack([columns, rows]) + view.surface.corner)
        p_CQ = rays * view.surface.depth[rows, columns][:, None]
        points.append(p_CQ @ view.X_PC[:2, :3].T + view.X_PC[:2, 3])
    low = np.min([p.min(axis=0) for p in points], axis=0) - _ROOM
    high = np.max([p.max(axis=0) for p in points], axis=0) + _ROOM
    return np.arange(low[0], high[0], SPACING), np.arange(low[1], high[1], SPACING)


def _look_up(view: View, x: Array, y: Array) -> Sheet:
    """Samples the surface of a view at each grid point.

    The depth z of a grid point (x, y) is found by fixed-point iteration: it is looked up at the pixel f (x, y) / z.
    """
    X_CP = np.linalg.inv(view.X_PC)
    px, py = np.meshgrid(x, y)
    cx, cy = (X_CP[i, 0] * px + X_CP[i, 1] * py + X_CP[i, 3] for i in (0, 1))
    surface, f = view.surface, view.camera.focal_length
    centre = np.array(view.camera.centre) - surface.corner
    height, width = surface.mask.shape
    depth = surface.depth.astype(np.float32)
    z = np.full(px.shape, float(np.percentile(surface.depth[surface.mask], 50.0)))
    for _ in range(_STEPS):
        column, row = f * cx / z + centre[0], f * cy / z + centre[1]
        place = column.astype(np.float32), row.astype(np.float32)
        z = cv2.remap(depth, *place, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE).astype(float)
    columns = np.clip(np.rint(f * cx / z + centre[0]).astype(np.intp), 0, width - 1)
    rows = np.clip(np.rint(f * cy / z + centre[1]).astype(np.intp), 0, height - 1)
    found = surface.depth[rows, columns]
    # If a surface is steeper than the ray, there can be no such pixel or several, and the iteration oscillates.
    missed = np.maximum(np.abs(f * cx / found + centre[0] - columns), np.abs(f * cy / found + centre[1] - rows))
    sure = surface.mask[rows, columns] & (missed <= _MAX_MISS)
    # Small gaps between certain columns also belong to the object.
    there = cv2.morphologyEx(sure.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((_GAP, _GAP), np.uint8)).astype(bool)
    heights = spread_nearest(view.X_PC[2, 2] * found + view.X_PC[2, 3], sure)
    return Sheet(there, heights, spread_nearest(view.labels[rows, columns], sure))


def collect_columns(
    x: Array, y: Array, *, share: Array, bottom: Array, top: Array, labels: Sequence[Labels]
) -> dict[int, ColumnSolid]:
    """Collects the columns of each appearance.

    Args:
        x: Grid coordinates along Px, [m].
        y: Grid coordinates along Py, [m].
        share: Fraction of each column's area that belongs to the object, (rows, columns).
        bottom: Lower end of each column, (rows, columns), [m].
        top: Upper end, (rows, columns), [m].
        labels: Appearance of the upper and of the lower half of each column, (rows, columns) each.
    """
    px, py = np.meshgrid(x, y)
    middle = 0.5 * (bottom + top)
    standing = (share > 0.0) & (top > bottom)
    parts: dict[int, list[tuple[Array, Array, Array]]] = {}
    for label, low, high in ((labels[0], middle, top), (labels[1], bottom, middle)):
        for number in np.unique(label[standing]):
            if number == _UNKNOWN:
                continue
            own = standing & (label == number)
            places = np.column_stack([px[own], py[own]])
            ends = np.column_stack([low[own], high[own]])
            parts.setdefault(int(number), []).append((places, share[own] * SPACING**2, ends))
    return {
        number: ColumnSolid(*(np.concatenate(arrays) for arrays in zip(*pieces, strict=True)))
        for number, pieces in sorted(parts.items())
    }


class _Pieces(NamedTuple):
    """N pieces of columns."""

    owner: NDArray[np.intp]  # index of the column, (N,)
    middle: Array  # (N, 3), [m]
    ends: Array  # lower and upper end, (N, 2), [m]


def carve(solids: Mapping[int, ColumnSolid], sides: Sequence[Side]) -> dict[int, ColumnSolid]:
    """Removes wide open hollows that are visible in other views from solids in P.

    No solid is removed completely.
    """
    pieces = {number: _cut(solid) for number, solid in solids.items()}
    points = np.concatenate([each.middle for each in pieces.values()])
    kept = np.ones(len(points), dtype=bool)
    for side in sides:
        kept &= ~_find_hollow(side, points)
    of_each = np.split(kept, np.cumsum([len(each.middle) for each in pieces.values()])[:-1])
    return {
        number: _join(solid, pieces[number], own)
        for (number, solid), own in zip(solids.items(), of_each, strict=True)
    }


def _find_hollow(side: Side, points: Array) -> Mask:
    """Finds points in P, (N, 3), inside hollows that are open towards either end of the viewing axis, (N,)."""
    x, y, sheets = find_sheets(side.views)
    there = sheets[0].there | sheets[1].there
    p = side.R_QP @ points.T
    columns = np.clip(np.rint((p[0] - x[0]) / SPACING).astype(np.intp), 0, len(x) - 1)
    rows = np.clip(np.rint((p[1] - y[0]) / SPACING).astype(np.intp), 0, len(y) - 1)
    hollow = np.zeros(len(points), dtype=bool)
    for sheet, sign in zip(sheets, (1.0, -1.0), strict=True):
        height = cv2.morphologyEx(np.where(there, sign * sheet.height, -np.inf), cv2.MORPH_CLOSE, _build_square(_RIM))
        height = cv2.dilate(height, _build_square(2.0 * _MARGIN))
        beyond = sign * p[2] > height[rows, columns] + _MARGIN
        empty = np.zeros(there.shape, np.uint8)
        empty[rows[beyond], columns[beyond]] = 1
        # Neighbouring pieces can be two grid cells apart.
        filled = cv2.morphologyEx(empty, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        wide = cv2.morphologyEx(filled, cv2.MORPH_OPEN, _build_square(_WIDTH))
        hollow |= beyond & wide[rows, columns].astype(bool)
    return hollow


def _build_square(width: float) -> NDArray[np.uint8]:
    """Builds a square structuring element of a given width, [m]."""
    length = 2 * round(0.5 * width / SPACING) + 1
    return np.ones((length, length), np.uint8)


def _cut(solid: ColumnSolid) -> _Pieces:
    low, high = solid.ends.T
    counts = np.maximum(np.ceil((high - low) / _PIECE).astype(np.intp), 1)
    owner = np.repeat(np.arange(len(counts)), counts)
    length = ((high - low) / counts)[owner]
    start = low[owner] + (np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]) * length
    middle = np.column_stack([solid.places[owner], start + 0.5 * length])
    return _Pieces(owner, middle, np.column_stack([start, start + length]))


def _join(solid: ColumnSolid, pieces: _Pieces, kept: Mask) -> ColumnSolid:
    """Merges adjacent remaining pieces of each column."""
    if kept.all() or not (kept & (np.diff(pieces.ends)[:, 0] > 0.0)).any():
        return solid
    joined = kept[1:] & kept[:-1] & (pieces.owner[1:] == pieces.owner[:-1])
    begins, ends = kept & ~np.append(False, joined), kept & ~np.append(joined, False)
    runs = pieces.owner[begins]
    return ColumnSolid(
        solid.places[runs], solid.areas[runs], np.column_stack([pieces.ends[begins, 0], pieces.ends[ends, 1]])
    )
