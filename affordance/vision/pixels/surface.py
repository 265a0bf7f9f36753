"""Surface of an object of any form in a picture: its smoothed depth, and its colour in full light.

A surface inclined away from the lamps looks darker. Its slope is computed from depth averaged over a few millimetres,
which is correct within a face and wrong at edges; there the colour is undetermined.
"""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.vision.pixels.rgbd import Camera, Picture
from affordance.vision.pixels.rig import compute_shading
from affordance.vision.pixels.segmentation import find_window, spread_nearest

# Sides of the windows over which depth is averaged, for itself and for its slope, [pixels]: over 81 readings the
# slope of one face is known to 0.1.
_DEPTH_SIDE, _SLOPE_SIDE = 5, 9
# Least light by which a colour is divided, relative to saturation.
_MIN_LIGHT = 0.2
# Light relative to saturation below which a surface is steep, or an edge between two faces.
_GOOD_LIGHT = 0.6


class Surface(NamedTuple):
    """Surface of the object in one view, in a window of the picture.

    Attributes:
        mask: True where a pixel shows the object, (height, width).
        corner: Column and row of the window's first pixel in the picture, (2,).
        depth: Averaged depth, (height, width), [m]; outside the mask that of the nearest pixel with readings.
        colour: Red, green and blue in full light, in [0, 1], (height, width, 3).
        lit: True where the slope is known well enough to determine the colour, (height, width).
    """

    mask: Mask
    corner: Array
    depth: Array
    colour: Array
    lit: Mask


def measure_surface(picture: Picture, mask: Mask, camera: Camera) -> Surface:
    """Measures depth and colour within a mask, which must not be empty."""
    window = find_window(mask, room=2 * _SLOPE_SIDE)
    mask, depth = mask[window], picture.depth[window]
    corner = np.array([window[1].start, window[0].start], dtype=float)
    # One in four readings next to the outline is of the background.
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & (depth > 0.0)
    inner = inner if inner.any() else mask & (depth > 0.0)
    fine, coarse = (_average(depth, inner, side) for side in (_DEPTH_SIDE, _SLOPE_SIDE))
    light = _measure_light(coarse, corner, camera)
    photograph = cv2.blur(cv2.medianBlur(np.ascontiguousarray(picture.colour[window]), 3), (3, 3)) / 255.0
    colour: Array = np.clip(photograph / np.maximum(light, _MIN_LIGHT)[..., None], 0.0, 1.0)
    return Surface(mask, corner, fine, colour, mask & (light >= _GOOD_LIGHT))


def _average(depth: Array, known: Mask, side: int) -> Array:
    """Averages the readings in a window around each pixel; without readings the nearest window with some counts."""
    weight = cv2.blur(known.astype(float), (side, side))
    total = cv2.blur(np.where(known, depth, 0.0), (side, side))
    there = weight > 0.5 / side**2
    return spread_nearest(np.where(there, total / np.where(there, weight, 1.0), 0.0), there)


def _measure_light(depth: Array, corner: Array, camera: Camera) -> Array:
    """Computes the light on the surface relative to saturation, from the slope of its depth, (height, width).

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
