"""Which pixels show an object of any form, however slim: what differs from the stand in colour or in depth.

Depth alone misses what is flatter than its noise, colour alone what has the colour of the stand. The outline is drawn
by colour where it can be, as colours are sharp and depth is not: halfway between the stand's and the object's own.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import NothingSeenError, OutOfViewError
from affordance.vision.pixels.rgbd import Mask, Picture
from affordance.vision.pixels.segmentation import check_picture
from affordance.vision.pixels.sensor_noise import SensorNoise

# Of the blur that takes noise off colours before they are compared with the stand's, [pixels].
_BLUR = 0.7
# Colours this many standard deviations of the blurred stand's own away from it are not the stand's: with fewer,
# specks of noise would remain in a picture of a million pixels.
_COLOUR_SDS = 6.0
# Readings averaged over so many pixels a side, and how many standard deviations nearer than the stand is nearer.
_DEPTH_SIDE, _DEPTH_SDS = 5, 4.0
# What the stand's own depth is off by at most, beside its noise: rounding of a renderer or a calibration, [m].
_STAND_ERROR = 1e-3
# Smaller specks are noise, [pixels].
_MIN_PIXELS = 60
# Of a normal distribution: its standard deviation by the median of absolute deviations.
_PER_MEDIAN = 1.4826


def find_silhouette(picture: Picture, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds the pixels that show the object, (height, width).

    Args:
        picture: What the camera recorded.
        stand_depth: Depth of the stand's top, [m].
        noise: That of the sensor.

    Raises:
        UnusablePictureError: Colour and depth do not fit together, or are too small.
        NoDepthError: Depth is no number, or there is too little of it.
        OneColourError: All pixels have the same colour.
        NothingSeenError: Nothing stands out from the stand.
        OutOfViewError: What does reaches the picture's edge.
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
        # Blur and mixed pixels reach beyond the outline, to where half of the object's own difference is left.
        outside = (difference < 0.5 * spread_nearest(difference, core)) & ~core & ~near
        found &= ~outside
    count, regions, statistics, _ = cv2.connectedComponentsWithStats(found.astype(np.uint8), connectivity=8)
    large = [number for number in range(1, count) if statistics[number, cv2.CC_STAT_AREA] >= _MIN_PIXELS]
    if not large:
        raise NothingSeenError(f"nothing differs from the stand, {stand_depth:g} m from the camera", *picture)
    mask: Mask = np.isin(regions, large)
    edge = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    if edge.any():
        reason = f"the object covers {int(edge.sum())} pixels of the picture's edge, must cover none"
        raise OutOfViewError(reason, *picture)
    return mask


def spread_nearest[T: np.generic](values: NDArray[T], known: Mask) -> NDArray[T]:
    """Gives every pixel the value of the nearest one that is known, (height, width); at least one must be."""
    _, nearest = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    owner = np.zeros(int(nearest.max()) + 1, dtype=np.intp)
    owner[nearest[known]] = np.flatnonzero(known)
    spread: NDArray[T] = values.ravel()[owner[nearest]]
    return spread


def _find_near(depth: Array, stand_depth: float, noise: SensorNoise) -> Mask:
    """What is nearer than the stand, without a rim as wide as half of the window it is averaged over."""
    filled = np.where(depth > 0.0, depth, stand_depth)
    sd = float(noise.compute_axial_sd(np.array(stand_depth), np.zeros(()))) / np.sqrt(_DEPTH_SIDE**2 / 2.0)
    near = cv2.blur(filled, (_DEPTH_SIDE, _DEPTH_SIDE)) < stand_depth - _STAND_ERROR - _DEPTH_SDS * sd
    side = _DEPTH_SIDE // 2 * 2 - 1
    mask: Mask = cv2.erode(near.astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool)
    return mask
