"""Solids of columns without their open hollows, which views from other sides show."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.objects.column_solid import ColumnSolid
from affordance.vision.pixels.columns import SPACING, View, find_sheets

# Length of a piece of a column that is kept or removed, [m].
_STEP = 1e-3
# Distance from a surface within which nothing is removed: two pixels, as outlines and averaged depths are off by one.
_MARGIN = 1e-3
# Least width of a hollow, and width up to which a pit is filled first: at edges, averaged depth mixes with that of
# what is behind, [m].
_WIDTH, _RIM = 0.01, 4e-3


class Side(NamedTuple):
    """Views of an object along Qz and against it, cameras posed in Q, and the rotation R_QP from P to Q, (3, 3)."""

    R_QP: Array
    views: tuple[View, View]


class _Pieces(NamedTuple):
    """Columns cut into pieces: owner and middle of each, (N,) and (N, 3), and its lower and upper end, (N, 2)."""

    owner: NDArray[np.intp]
    middle: Array
    ends: Array


def carve(solids: Mapping[int, ColumnSolid], sides: Sequence[Side]) -> dict[int, ColumnSolid]:
    """Removes from solids in P the hollows that sides show to be open and wide; a solid never vanishes."""
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
    """Returns which points of the solids, (N, 3) in P, lie in a hollow that is open to one end of the axis."""
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
        # Pieces lie up to two columns apart.
        filled = cv2.morphologyEx(empty, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        wide = cv2.morphologyEx(filled, cv2.MORPH_OPEN, _build_square(_WIDTH))
        hollow |= beyond & wide[rows, columns].astype(bool)
    return hollow


def _build_square(width: float) -> NDArray[np.uint8]:
    """Returns the mask of a square of a width, [m]."""
    length = 2 * round(0.5 * width / SPACING) + 1
    return np.ones((length, length), np.uint8)


def _cut(solid: ColumnSolid) -> _Pieces:
    low, high = solid.ends.T
    counts = np.maximum(np.ceil((high - low) / _STEP).astype(np.intp), 1)
    owner = np.repeat(np.arange(len(counts)), counts)
    length = ((high - low) / counts)[owner]
    start = low[owner] + (np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]) * length
    middle = np.column_stack([solid.places[owner], start + 0.5 * length])
    return _Pieces(owner, middle, np.column_stack([start, start + length]))


def _join(solid: ColumnSolid, pieces: _Pieces, kept: Mask) -> ColumnSolid:
    """Joins the pieces that are kept; those of a column that follow one another are one column again."""
    if kept.all() or not (kept & (np.diff(pieces.ends)[:, 0] > 0.0)).any():
        return solid
    joined = kept[1:] & kept[:-1] & (pieces.owner[1:] == pieces.owner[:-1])
    begins, ends = kept & ~np.append(False, joined), kept & ~np.append(joined, False)
    runs = pieces.owner[begins]
    return ColumnSolid(
        solid.places[runs], solid.areas[runs], np.column_stack([pieces.ends[begins, 0], pieces.ends[ends, 1]])
    )
