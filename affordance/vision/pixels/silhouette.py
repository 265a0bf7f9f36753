"""Segmentation of an object of any form, however slim, from the stand by colour or depth.

Depth alone misses objects flatter than its noise, colour alone those with the stand's colour. Where possible the
outline is drawn by colour, which is sharper than depth: halfway between the stand's colour and the object's.
"""

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import NothingSeenError
from affordance.vision.pixels.rgbd import Picture
from affordance.vision.pixels.segmentation import check_edge, check_picture, keep_large, spread_nearest
from affordance.vision.pixels.sensor_noise import STAND_ERROR, SensorNoise

# Standard deviation of the blur that denoises colours before they are compared with the stand's, [pixels].
_BLUR = 0.7
# Number of standard deviations of the blurred stand's colour beyond which a colour is not the stand's: with fewer,
# specks of noise would remain in a picture of a million pixels.
_COLOUR_SDS = 6.0
# Side of the window over which readings are averaged, [pixels], and number of standard deviations that count as
# nearer.
_DEPTH_SIDE, _DEPTH_SDS = 5, 4.0
# Least size of a region that is not noise, [pixels].
_MIN_PIXELS = 60
# Standard deviation of a normal distribution per median absolute deviation.
_PER_MEDIAN = 1.4826


def find_silhouette(picture: Picture, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds the pixels that show the object, (height, width).

    Args:
        picture: Picture of the object on the stand.
        stand_depth: Depth of the stand's top, [m].
        noise: Noise of the sensor.

    Raises:
        UnusablePictureError: Colour and depth do not match, or are too small.
        NoDepthError: Depth readings are not finite, or too few.
        OneColourError: All pixels have the same colour.
        NothingSeenError: Nothing differs from the stand.
        OutOfViewError: The object reaches the picture's edge.
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
        # Blur and mixed pixels extend the mask to less than half of the object's own difference.
        outside = (difference < 0.5 * spread_nearest(difference, core)) & ~core & ~near
        found &= ~outside
    mask, _ = keep_large(found, _MIN_PIXELS)
    if not mask.any():
        raise NothingSeenError(f"nothing differs from the stand, {stand_depth:g} m from the camera", *picture)
    check_edge(mask, picture)
    return mask


def _find_near(depth: Array, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds pixels nearer than the stand, without a rim of half the width of the averaging window."""
    filled = np.where(depth > 0.0, depth, stand_depth)
    sd = float(noise.compute_axial_sd(np.array(stand_depth), np.zeros(()))) / np.sqrt(_DEPTH_SIDE**2 / 2.0)
    near = cv2.blur(filled, (_DEPTH_SIDE, _DEPTH_SIDE)) < stand_depth - STAND_ERROR - _DEPTH_SDS * sd
    side = _DEPTH_SIDE // 2 * 2 - 1
    mask: Mask = cv2.erode(near.astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool)
    return mask
