"""Segmentation of an object on a table."""

import cv2
import numpy as np
from scipy.ndimage import binary_fill_holes

from affordance.arrays import Array, Mask
from affordance.exceptions import NothingSeenError, TooSmallError
from affordance.extensions.pixels.photographs.table import Table

# Smallest and largest height of an object's points above the table, [m].
_LOWEST, _HIGHEST = 8e-3, 0.5
# Largest depth step between neighbouring pixels of one object, [m].
_JUMP = 0.02
# Largest distance of a selected pixel from the object, [pixels].
_MISSED_BY = 8.0
_LEAST_PIXELS = 150


def find_object(points: Array, table: Table, at: tuple[float, float] | None) -> Mask:
    """Finds the pixels of an object on a table.

    Args:
        points: Positions of pixels in C, (height, width, 3), [m]; NaN without a depth reading.
        table: Table.
        at: Pixel of the object, column and row; None for the object that is nearest to the middle.

    Raises:
        NothingSeenError: There is no object, or none at the pixel.
        TooSmallError: The object has too few pixels.
    """
    depth = points[..., 2]
    height, width = depth.shape
    heights = table.measure_heights(points)
    with np.errstate(invalid="ignore"):
        above = (heights > _LOWEST) & (heights < _HIGHEST)
        cut = np.zeros_like(above)
        cut[:, 1:] |= np.abs(np.diff(depth, axis=1)) > _JUMP
        cut[1:] |= np.abs(np.diff(depth, axis=0)) > _JUMP
    square = np.ones((3, 3), np.uint8)
    opened = cv2.morphologyEx((above & ~cut).astype(np.uint8), cv2.MORPH_OPEN, square)
    count, labels, sizes, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
    large = [number for number in range(1, count) if sizes[number, cv2.CC_STAT_AREA] >= _LEAST_PIXELS]
    place = np.array([0.5 * width, 0.5 * height] if at is None else at)
    rows, columns = np.nonzero(np.isin(labels, large))
    if not len(rows):
        raise NothingSeenError("nothing stands on the table", np.zeros((height, width, 3)), depth)
    distances = np.hypot(columns - place[0], rows - place[1])
    nearest = int(np.argmin(distances))
    if at is not None and distances[nearest] > _MISSED_BY:
        closest = f"({columns[nearest]}, {rows[nearest]})"
        problem = f"pixel ({at[0]:g}, {at[1]:g}) shows no object above the table; the nearest one is at {closest}"
        raise NothingSeenError(problem, np.zeros((height, width, 3)), depth)
    chosen = labels == labels[rows[nearest], columns[nearest]]
    grown = cv2.dilate(chosen.astype(np.uint8), square).astype(bool) & above
    # Missing readings in holes of the mask are due to gloss, because shadows are outside.
    filled: Mask = binary_fill_holes(grown)
    return filled


def check_mask(mask: Mask, depth: Array) -> None:
    """Checks that a mask has enough pixels with depth readings. Otherwise a TooSmallError is raised."""
    number = int((mask & np.isfinite(depth)).sum())
    if number < _LEAST_PIXELS:
        problem = f"the object has {number} pixels with a depth reading, must have at least {_LEAST_PIXELS}"
        raise TooSmallError(f"{problem}; go nearer", np.zeros((*mask.shape, 3)), depth)


def reaches_edge(mask: Mask) -> bool:
    """Returns True if an object reaches the edge of the image, so that it can extend beyond it."""
    return bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())
