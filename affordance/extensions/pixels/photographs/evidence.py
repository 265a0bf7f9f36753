"""Evidence in an image about the shape of an object: surface points, empty space, and rays that hit the object."""

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.superquadric import Evidence
from affordance.extensions.pixels.photographs.table import Table

# Largest number of depth readings, largest number of rays, and number of points per ray.
_MOST_READINGS, _MOST_RAYS, _STEPS = 250, 160, 12
# Distance from the outline beyond which rays miss the object, as a fraction of its width, and smallest distance,
# [pixels]. This is the uncertainty of the outline in colour and depth images.
_BESIDE, _LEAST_BESIDE = 0.03, 3
# Missing readings within this distance of a nearer object can be occluded by it, [pixels].
_IN_FRONT = 12
# Largest difference between depth readings of one object, [m].
_SAME = 0.02
# Distance between the end of empty space and the visible surface behind it, [m].
_BEFORE = 5e-3
# Height up to which space can be known to be empty, as a multiple of the height of the object.
_HIGHER = 1.3


def collect_evidence(
    points: Array, mask: Mask, table: Table, camera: PinholeCamera, X_CW: Array, order: Array
) -> Evidence:
    """Collects the evidence about a masked object in frame W.

    Missing readings outside the mask are shadows on the background, so the ray is empty down to the table. They are
    ignored next to nearer objects, which can occlude the object. Missing readings inside the mask are due to gloss,
    so the ray hits the object.

    Args:
        points: Positions of pixels in C, (height, width, 3), [m]; NaN without a depth reading.
        mask: Pixels of the object, (height, width).
        table: Table below the object.
        camera: Camera.
        X_CW: Pose of W in C, (4, 4).
        order: Random number of each pixel, (height, width), which determines the sampled readings and rays. Adding a
            pixel to the mask changes at most one of them.
    """
    is_read = np.isfinite(points[..., 2])
    square = np.ones((3, 3), np.uint8)
    inner = cv2.erode(mask.astype(np.uint8), square).astype(bool)
    shown = inner & is_read if (inner & is_read).any() else mask & is_read
    surface = _to_table(points[shown][np.argsort(order[shown])], X_CW)
    top = _HIGHER * float(np.percentile(surface[:, 2], 98.0))
    surface = surface[surface[:, 2] > 0.0][:_MOST_READINGS]
    width = np.sqrt(mask.sum())
    wide = max(_LEAST_BESIDE, round(_BESIDE * width))
    rim = _grow(mask, wide + 1) & ~_grow(mask, wide)
    far = _grow(mask, wide + 1 + round(0.2 * width)) & ~_grow(mask, wide + round(0.2 * width))
    object_depth = _spread(np.where(mask & is_read, points[..., 2], np.nan))
    background = np.where(is_read & ~mask, points[..., 2], np.inf)
    window = np.ones((2 * _IN_FRONT + 1, 2 * _IN_FRONT + 1), np.uint8)
    nearest = np.where(is_read, background, cv2.erode(background, window))
    is_hidden = nearest < object_depth - _SAME
    missing = inner & ~is_read
    rays = []
    for where, ends in ((rim | far) & ~is_hidden, True), (missing, False):
        rows, columns = np.argwhere(where)[np.argsort(order[where])][:_MOST_RAYS].T
        directions = camera.compute_rays(columns, rows)
        seen = (
            np.where(is_read, points[..., 2], np.inf)[rows, columns] - _BEFORE if ends else np.full(len(rows), np.inf)
        )
        rays.append(_sample(directions, seen, table, top, X_CW))
    return Evidence(surface, *rays)


def _sample(directions: Array, seen: Array, table: Table, top: float, X_CW: Array) -> Array:
    """Samples rays from the height ``top`` to the table or to the visible surface, (K, S, 3) in W."""
    slope = directions @ table.normal
    slope = np.where(np.abs(slope) < 1e-6, -1e-6, slope)
    at_top, at_table = (table.offset + top) / slope, table.offset / slope  # depths
    first = np.maximum(np.minimum(at_top, at_table), 0.05)
    last = np.minimum(np.maximum(at_top, at_table), seen)
    # Rays that are nearly parallel to the table are limited to one metre.
    last = np.minimum(last, first + 1.0)
    is_long = last > first
    steps = np.linspace(0.0, 1.0, _STEPS)
    depth = first[is_long, None] + steps * (last - first)[is_long, None]
    return _to_table(depth[..., None] * directions[is_long, None, :], X_CW)


def _to_table(p_C: Array, X_CW: Array) -> Array:
    moved: Array = (p_C - X_CW[:3, 3]) @ X_CW[:3, :3]
    return moved


def _grow(mask: Mask, by: int) -> Mask:
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1))
    return cv2.dilate(mask.astype(np.uint8), disc).astype(bool)


def _spread(values: Array) -> Array:
    """Fills pixels without a value with the value of the nearest pixel."""
    nearest = distance_transform_edt(np.isnan(values), return_distances=False, return_indices=True)
    spread: Array = values[tuple(nearest)]
    return spread
