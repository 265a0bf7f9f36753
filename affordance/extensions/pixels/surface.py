"""Measurement of an object's silhouette, smoothed depth, and colour under full illumination.

The silhouette is based on depth and colour. Depth alone does not detect objects that are flatter than its noise;
colour alone does not detect objects that have the colour of the stand. If possible, the outline is determined from
colour, which is sharper than depth: it is where the colour is halfway between the object and the stand.

Inclined surfaces look darker. Their slope is computed from depth that is averaged over a few millimetres. This is
correct within a face but not at edges, where the colour under full illumination remains unknown.
"""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import NothingSeenError
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.rig import compute_shading
from affordance.extensions.pixels.segmentation import (
    check_edge,
    check_picture,
    find_window,
    keep_large,
    spread_nearest,
)
from affordance.extensions.pixels.sensor_noise import STAND_ERROR, SensorNoise

# Standard deviation of the Gaussian blur for denoising colours before they are compared with the stand, [pixels].
_BLUR = 0.7
# Threshold for the difference between a blurred colour and the stand, in standard deviations. A lower threshold would
# leave specks of noise in an image with a million pixels.
_COLOUR_SDS = 6.0
# Threshold for the difference between averaged depth and the stand, in standard deviations.
_DEPTH_SDS = 4.0
# Smallest size of a region that is not noise, [pixels].
_MIN_PIXELS = 60
# Ratio of a normal distribution's standard deviation to its median absolute deviation.
_PER_MEDIAN = 1.4826
# Widths of the averaging windows for depth and for its slope, [pixels]. The slope of a face has an error of 0.1 with
# 81 readings.
_DEPTH_SIDE, _SLOPE_SIDE = 5, 9
# Smallest illumination by which colours are divided, relative to saturation.
_MIN_LIGHT = 0.2
# Smallest illumination of a well-lit surface, relative to saturation; otherwise it is steep or an edge.
_GOOD_LIGHT = 0.6


def find_silhouette(picture: Picture, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds the pixels of the object, (height, width).

    Args:
        picture: Colour and depth image.
        stand_depth: Depth of the stand's top, [m].
        noise: Sensor noise.

    Raises:
        SeeingError: The image fails ``check_picture``, shows only the stand (NothingSeenError), or shows an object at
            its edge (OutOfViewError).
    """
    check_picture(picture)
    colour = picture.colour.astype(np.float32)
    stand = np.median(colour.reshape(-1, 3), axis=0)
    difference = np.abs(cv2.GaussianBlur(colour, (0, 0), _BLUR) - stand).max(axis=2)
    spread = _PER_MEDIAN * float(np.median(difference))
    near = _find_near(picture.depth, stand_depth, noise)
    found = (difference > _COLOUR_SDS * max(spread, 0.5)) | near
    found = cv2.morphologyEx(found.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)).astype(bool)
    core = cv2.erode(found.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    if core.any():
        # Blurred pixels outside the object differ from the stand by less than half as much as the object.
        outside = (difference < 0.5 * spread_nearest(difference, core)) & ~core & ~near
        found &= ~outside
    mask, _ = keep_large(found, _MIN_PIXELS)
    if not mask.any():
        raise NothingSeenError(f"nothing differs from the stand, {stand_depth:g} m from the camera", *picture)
    check_edge(mask, picture)
    return mask


def _find_near(depth: Array, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds pixels that are nearer than the stand, except a rim of half the averaging window."""
    filled = np.where(depth > 0.0, depth, stand_depth)
    sd = float(noise.compute_axial_sd(np.array(stand_depth), np.zeros(()))) / np.sqrt(_DEPTH_SIDE**2 / 2.0)
    near = cv2.blur(filled, (_DEPTH_SIDE, _DEPTH_SIDE)) < stand_depth - STAND_ERROR - _DEPTH_SDS * sd
    side = _DEPTH_SIDE // 2 * 2 - 1
    return cv2.erode(near.astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool)


class Surface(NamedTuple):
    """Visible surface of the object in a window of one view.

    Attributes:
        mask: True where the object is visible, (height, width).
        corner: Column and row of the first pixel of the window, (2,).
        depth: Averaged depth, (height, width), [m]; outside the mask, the depth of the nearest pixel with readings.
        colour: Colour under full illumination, in [0, 1], (height, width, 3); valid where ``lit`` is True.
        lit: True where the slope of the surface is known well enough to compute the colour, (height, width).
    """

    mask: Mask
    corner: Array
    depth: Array
    colour: Array
    lit: Mask


def measure_surface(picture: Picture, mask: Mask, camera: Camera) -> Surface:
    """Measures depth and colour within a non-empty mask."""
    window = find_window(mask, room=2 * _SLOPE_SIDE)
    mask, depth = mask[window], picture.depth[window]
    corner = np.array([window[1].start, window[0].start], dtype=float)
    # Every fourth reading next to the outline belongs to the background.
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool) & (depth > 0.0)
    inner = inner if inner.any() else mask & (depth > 0.0)
    fine, coarse = (_average(depth, inner, side) for side in (_DEPTH_SIDE, _SLOPE_SIDE))
    light = _measure_light(coarse, corner, camera)
    photograph = cv2.blur(cv2.medianBlur(np.ascontiguousarray(picture.colour[window]), 3), (3, 3)) / 255.0
    colour: Array = np.clip(photograph / np.maximum(light, _MIN_LIGHT)[..., None], 0.0, 1.0)
    return Surface(mask, corner, fine, colour, mask & (light >= _GOOD_LIGHT))


def _average(depth: Array, known: Mask, side: int) -> Array:
    """Averages depth readings in a window around each pixel. Empty windows get the mean of the nearest window."""
    weight = cv2.blur(known.astype(float), (side, side))
    total = cv2.blur(np.where(known, depth, 0.0), (side, side))
    there = weight > 0.5 / side**2
    return spread_nearest(np.where(there, total / np.where(there, weight, 1.0), 0.0), there)


def _measure_light(depth: Array, corner: Array, camera: Camera) -> Array:
    """Computes the illumination of the surface relative to saturation, (height, width), from surface normals.

    A point is p = z (x / f, y / f, 1), with x and y relative to the principal point. Its normal dp/du x dp/dv is
    proportional to (-f dz/du, -f dz/dv, z + x dz/du + y dz/dv), and points away from the camera.
    """
    f = camera.focal_length
    slope_u = cv2.blur(cv2.Sobel(depth, cv2.CV_64F, 1, 0, ksize=5, scale=1.0 / 128.0), (5, 5))
    slope_v = cv2.blur(cv2.Sobel(depth, cv2.CV_64F, 0, 1, ksize=5, scale=1.0 / 128.0), (5, 5))
    rows, columns = np.indices(depth.shape)
    x, y = columns + corner[0] - camera.centre[0], rows + corner[1] - camera.centre[1]
    inwards = np.stack([-f * slope_u, -f * slope_v, depth + x * slope_u + y * slope_v], axis=-1).reshape(-1, 3)
    outwards = -inwards / np.linalg.norm(inwards, axis=1, keepdims=True)
    return compute_shading(outwards).reshape(depth.shape)
