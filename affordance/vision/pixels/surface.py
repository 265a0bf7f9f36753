"""What a picture says of the surface of an object of any form: its depth without noise, and its colour in full light.

A surface that is turned away from the lamps looks darker. Its slope is taken from depth averaged over a few
millimetres, which is right within a face and wrong where two meet; there a colour cannot be told.
"""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array
from affordance.vision.pixels.rgbd import Camera, Mask, Picture
from affordance.vision.pixels.rig import compute_shading
from affordance.vision.pixels.silhouette import spread_nearest

# Sides of the windows over which depth is averaged for itself and for its slope, [pixels]: over 81 readings the slope
# of one face is known to 0.1.
_DEPTH_SIDE, _SLOPE_SIDE = 5, 9
# Least light that a colour is divided by, of what saturates a pixel.
_MIN_LIGHT = 0.2
# In a darker light than this a surface is steep, or what is seen is the edge between two faces.
_GOOD_LIGHT = 0.6


class Surface(NamedTuple):
    """What one view shows of the object, in a window of its picture.

    Attributes:
        mask: Which pixels show it, (height, width).
        corner: Column and row of the window's first pixel in the picture, (2,).
        depth: Averaged, (height, width), [m]; where the mask is false, that of the nearest pixel that shows it.
        colour: Red, green and blue in full light, in [0, 1], (height, width, 3).
        lit: Where the slope is known well enough for that, (height, width).
    """

    mask: Mask
    corner: Array
    depth: Array
    colour: Array
    lit: Mask


def measure_surface(picture: Picture, mask: Mask, camera: Camera) -> Surface:
    """Measures depth and colour of what a mask shows; the mask must show something."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    room = 2 * _SLOPE_SIDE
    window = (
        slice(max(0, int(rows[0]) - room), int(rows[-1]) + room + 1),
        slice(max(0, int(columns[0]) - room), int(columns[-1]) + room + 1),
    )
    mask, depth = mask[window], picture.depth[window]
    corner = np.array([window[1].start, window[0].start], dtype=float)
    # Readings beside the outline are taken from behind it one time in four.
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & (depth > 0.0)
    inner = inner if inner.any() else mask & (depth > 0.0)
    fine, coarse = (_average(depth, inner, side) for side in (_DEPTH_SIDE, _SLOPE_SIDE))
    light = _measure_light(coarse, corner, camera)
    photograph = cv2.blur(cv2.medianBlur(np.ascontiguousarray(picture.colour[window]), 3), (3, 3)) / 255.0
    colour: Array = np.clip(photograph / np.maximum(light, _MIN_LIGHT)[..., None], 0.0, 1.0)
    return Surface(mask, corner, fine, colour, mask & (light >= _GOOD_LIGHT))


def _average(depth: Array, known: Mask, side: int) -> Array:
    """Mean of the readings in a window around each pixel; that of the nearest window with any where there is none."""
    weight = cv2.blur(known.astype(float), (side, side))
    total = cv2.blur(np.where(known, depth, 0.0), (side, side))
    there = weight > 0.5 / side**2
    return spread_nearest(np.where(there, total / np.where(there, weight, 1.0), 0.0), there)


def _measure_light(depth: Array, corner: Array, camera: Camera) -> Array:
    """Light that falls on the surface, of what saturates a pixel, by the slope of its depth, (height, width).

    A point is p = z (x / f, y / f, 1) with x, y from the principal point, so that dp/du x dp/dv is proportional to
    (-f dz/du, -f dz/dv, z + x dz/du + y dz/dv), away from the camera.
    """
    f = camera.focal_length
    slope_u = cv2.blur(cv2.Sobel(depth, cv2.CV_64F, 1, 0, ksize=5, scale=1.0 / 128.0), (5, 5))
    slope_v = cv2.blur(cv2.Sobel(depth, cv2.CV_64F, 0, 1, ksize=5, scale=1.0 / 128.0), (5, 5))
    rows, columns = np.indices(depth.shape)
    x, y = columns + corner[0] - camera.centre[0], rows + corner[1] - camera.centre[1]
    inwards = np.stack([-f * slope_u, -f * slope_v, depth + x * slope_u + y * slope_v], axis=-1).reshape(-1, 3)
    outwards = -inwards / np.linalg.norm(inwards, axis=1, keepdims=True)
    return compute_shading(outwards).reshape(depth.shape)
