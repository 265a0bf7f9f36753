"""Segmentation of an image into the object and its parts.

The object consists of all pixels that are nearer than the stand. Its parts are regions of one tint, which does not
depend on shading. A region with a waist is split into several parts of the same colour. Labels of the renderer are
not used.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.exceptions import (
    NoDepthError,
    NothingSeenError,
    OneColourError,
    OutOfViewError,
    TooSmallError,
    UnusablePictureError,
)
from affordance.extensions.pixels.rgbd import Labels, Picture
from affordance.extensions.pixels.sensor_noise import STAND_ERROR, SensorNoise
from affordance.objects.colour import compute_tints

# Smallest number of pixels of a part, equal to a disc with a diameter of twelve pixels. Fitting nine parameters needs
# several times as many readings inside the rim, which is three pixels wide.
MIN_PIXELS = 110
# A depth reading belongs to the object if it is nearer than the stand by this number of standard deviations. One in
# 30,000 pixels of the stand exceeds this threshold by chance; such specks are removed.
_NUM_SDS = 4.0
# Smallest fraction of pixels that must have depth readings.
_MIN_READABLE = 0.5
# Widths of the median and mean filters for denoising colours, and their combined radius, up to which the colour of
# the stand is mixed into the object, [pixels].
_MEDIAN_SIDE, _MEAN_SIDE, _SMOOTHING = 5, 3, 3
# Largest distance between tints of one material (colours that differ by ten units are visibly different), and bin
# width of the tint histogram, [CIELAB].
_TINT_RADIUS, _TINT_BIN = 10.0, 2.0
# For smaller brightness, relative to saturation, the largest distance is increased, because it would be below four
# standard deviations of the tint noise of a smoothed grey (0.7 divided by the root of the brightness).
_LIT = 0.08
# Narrower strips are mixed colours of two parts, [pixels].
_STRIP = 5
# A region has a waist if erosion splits it into pieces. The eroded width must be at most this fraction of the largest
# distance of each piece from the outline.
_WAIST = 0.7
# Smallest eroded width for finding waists, [pixels], and number of widths that are tried.
_LEAST_WAIST, _NUM_LEVELS = 1.5, 24
_UNKNOWN = -1


class Segmentation(NamedTuple):
    """Parts of an image."""

    labels: Labels  # index of each pixel's part, (height, width), or -1
    num_parts: int


def check_picture(picture: Picture) -> None:
    """Checks that a colour and depth image is usable.

    Raises:
        UnusablePictureError: Colour and depth do not match or are too small.
        NoDepthError: There are too few depth readings, or not all are finite.
        OneColourError: All pixels have the same colour.
    """
    colour, depth = picture
    if colour.ndim != 3 or colour.shape[2] != 3 or colour.dtype != np.uint8 or depth.shape != colour.shape[:2]:
        problem = f"colour is {colour.shape} of {colour.dtype} and depth {depth.shape}"
        raise UnusablePictureError(f"{problem}, must be (height, width, 3) of uint8 and (height, width)", *picture)
    if depth.size < MIN_PIXELS:
        size = f"{depth.shape[1]}x{depth.shape[0]}"
        raise UnusablePictureError(f"the picture has {size} pixels, must have at least {MIN_PIXELS}", *picture)
    if not np.isfinite(depth).all():
        count = int((~np.isfinite(depth)).sum())
        raise NoDepthError(f"{count} of {depth.size} depth readings are not finite, all must be finite", *picture)
    readable = float((depth > 0.0).mean())
    if readable < _MIN_READABLE:
        reason = f"{100 * readable:.0f} % of the picture has depth, must be at least {100 * _MIN_READABLE:.0f} %"
        raise NoDepthError(reason, *picture)
    if (colour == colour[0, 0]).all():
        raise OneColourError(f"all pixels have the colour {tuple(int(c) for c in colour[0, 0])}", *picture)


def segment(picture: Picture, stand_depth: float, noise: SensorNoise) -> Segmentation:
    """Segments the object into its parts.

    Args:
        picture: Colour and depth image.
        stand_depth: Depth of the stand's top, [m].
        noise: Sensor noise.

    Raises:
        SeeingError: The image fails ``check_picture``, nothing is nearer than the stand (NothingSeenError), the
            object reaches the edge (OutOfViewError), or the object or a part has too few pixels (TooSmallError).
    """
    check_picture(picture)
    object_mask = find_object(picture, stand_depth, noise)
    labels = np.full(object_mask.shape, _UNKNOWN, dtype=np.int32)
    window = find_window(object_mask, room=2 * _SMOOTHING)
    within, seen = labels[window], object_mask[window]
    median = cv2.medianBlur(np.ascontiguousarray(picture.colour[window]), _MEDIAN_SIDE)
    smooth = cv2.blur((median / 255.0).astype(np.float32), (_MEAN_SIDE, _MEAN_SIDE))
    num_parts = 0
    regions = _split_by_tint(seen, smooth)
    if not regions:
        reason = f"fewer than {MIN_PIXELS // 4} connected pixels of one tint are nearer than the stand"
        raise TooSmallError(f"{reason}, without the object's rim of {_SMOOTHING} pixels", *picture)
    for region in regions:
        for part in _split_at_waists(region):
            within[part] = num_parts
            num_parts += 1
    for number in range(num_parts):
        count = int((labels == number).sum())
        if count < MIN_PIXELS:
            raise TooSmallError(f"a part covers {count} pixels, must cover at least {MIN_PIXELS}", *picture)
    return Segmentation(labels, num_parts)


def find_object(picture: Picture, stand_depth: float, noise: SensorNoise) -> Mask:
    """Finds the pixels that are nearer than the stand, (height, width); see ``segment``."""
    threshold = (
        stand_depth - STAND_ERROR - _NUM_SDS * float(noise.compute_axial_sd(np.array(stand_depth), np.zeros(())))
    )
    # Missing readings (0) belong to strongly inclined surfaces of the object, never to the stand.
    near = picture.depth < threshold
    mask = cv2.medianBlur(near.astype(np.uint8), 3)
    if not mask.any():
        raise NothingSeenError(f"nothing is nearer than the stand, {stand_depth:g} m from the camera", *picture)
    found, largest = keep_large(mask, MIN_PIXELS)
    if not found.any():
        reason = f"the object nearer than the stand covers {largest} pixels, must cover at least {MIN_PIXELS}"
        raise TooSmallError(reason, *picture)
    check_edge(found, picture)
    return found


def keep_large(mask: NDArray[Any], least: int) -> tuple[Mask, int]:
    """Finds connected pieces of a mask with at least ``least`` pixels, and the size of the largest piece."""
    _, pieces, statistics, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    sizes = statistics[1:, cv2.CC_STAT_AREA]
    kept: Mask = np.isin(pieces, 1 + np.flatnonzero(sizes >= least))
    return kept, int(sizes.max(initial=0))


def check_edge(mask: Mask, picture: Picture) -> None:
    """Checks that an object does not reach the edge of the image. Otherwise an OutOfViewError is raised."""
    count = int(np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]]).sum())
    if count:
        raise OutOfViewError(f"the object covers {count} pixels of the picture's edge, must cover none", *picture)


def spread_nearest[T: np.generic](values: NDArray[T], known: Mask) -> NDArray[T]:
    """Assigns the value of the nearest known pixel to each pixel, (height, width). At least one must be known."""
    _, nearest = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    owner = np.zeros(int(nearest.max()) + 1, dtype=np.intp)
    owner[nearest[known]] = np.flatnonzero(known)
    spread: NDArray[T] = values.ravel()[owner[nearest]]
    return spread


def find_window(mask: Mask, room: int) -> tuple[slice, slice]:
    """Computes the ranges of rows and columns of a non-empty mask, with a margin ``room``, [pixels].

    The ranges are clipped to the image.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return (
        slice(max(0, int(rows[0]) - room), int(rows[-1]) + room + 1),
        slice(max(0, int(columns[0]) - room), int(columns[-1]) + room + 1),
    )


def _split_by_tint(mask: Mask, colour: NDArray[Any]) -> list[Mask]:
    """Splits a mask into regions of one tint, starting with the most frequent tint of well-lit pixels.

    Returns no regions if the colour of the stand is mixed into all pixels of a small or narrow object.
    """
    side = 2 * _SMOOTHING + 1
    core = cv2.erode(mask.astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool)
    core = core if core.any() else mask
    points, brightness = compute_tints(colour[core]), colour[core].max(axis=1)
    lit = brightness >= _LIT
    radius = _TINT_RADIUS * np.sqrt(np.maximum(1.0, _LIT / np.maximum(brightness, 1.0 / 255.0)))
    left = np.ones(len(points), dtype=bool)
    modes: list[Array] = []
    while left.sum() >= MIN_PIXELS // 4:
        pool = left & lit if (left & lit).sum() >= MIN_PIXELS // 4 else left
        mode = find_mode(points[pool])
        near = np.linalg.norm(points - mode, axis=1) <= radius
        if (near & pool).sum() < MIN_PIXELS // 4:
            break
        modes.append(points[near & pool].mean(axis=0))
        left &= ~near
    if not modes:
        return []
    nearest = np.argmin([np.linalg.norm(points - mode, axis=1) for mode in modes], axis=0)
    seeds = np.zeros(mask.shape, dtype=np.int32)
    seeds[core] = nearest + 1
    regions = []
    for number in range(1, len(modes) + 1):
        # Strips of mixed colours between two parts are removed.
        one = cv2.morphologyEx(
            (seeds == number).astype(np.uint8), cv2.MORPH_OPEN, np.ones((_STRIP, _STRIP), np.uint8)
        )
        count, pieces, statistics, _ = cv2.connectedComponentsWithStats(one, connectivity=4)
        regions += [pieces == k for k in range(1, count) if statistics[k, cv2.CC_STAT_AREA] >= MIN_PIXELS // 4]
    return _grow(regions, mask) if regions else []


def find_mode(points: Array, bin_width: float = _TINT_BIN) -> Array:
    """Computes the mode, (2,), of points in a plane, (N, 2), with a histogram."""
    low, high = points.min(axis=0), points.max(axis=0)
    shape = np.maximum(1, np.ceil((high - low) / bin_width)).astype(int) + 1
    index = ((points - low) / bin_width).astype(int)
    counts = np.zeros(shape)
    np.add.at(counts, tuple(index.T), 1.0)
    peak = np.unravel_index(np.argmax(cv2.GaussianBlur(counts, (5, 5), 1.0)), counts.shape)
    return low + (np.array(peak) + 0.5) * bin_width


def _grow(regions: list[Mask], mask: Mask) -> list[Mask]:
    """Assigns each pixel of a mask to the nearest region."""
    seeds = np.zeros(mask.shape, dtype=np.int32)
    for number, region in enumerate(regions):
        seeds[region & mask] = number + 1
    owners = spread_nearest(seeds, seeds > 0)
    return [mask & (owners == number + 1) for number in range(len(regions))]


def _split_at_waists(region: Mask) -> list[Mask]:
    """Splits a region at its waists into convex pieces, if it has any."""
    window = find_window(region, room=2)
    small = region[window].astype(np.uint8)
    distance = cv2.distanceTransform(small, cv2.DIST_L2, 5)
    cores = _find_cores(distance)
    if len(cores) < 2:
        return [region]
    markers = np.zeros(small.shape, dtype=np.int32)
    for number, core in enumerate(cores):
        markers[core] = number + 1
    # Distances from a core are divided by its radius, so that two touching ellipsoids with different widths are split
    # at the waist.
    ways = [
        cv2.distanceTransform((markers != number + 1).astype(np.uint8), cv2.DIST_L2, 5) / distance[core].max()
        for number, core in enumerate(cores)
    ]
    nearest = np.argmin(ways, axis=0)
    pieces = []
    for number in range(len(cores)):
        piece = np.zeros_like(region)
        piece[window] = (nearest == number) & (small > 0)
        pieces.append(piece)
    return pieces


def _find_cores(distance: NDArray[Any]) -> list[Mask]:
    """Finds the core of each convex piece of a region from distances to the outline."""
    best: list[Mask] = []
    for level in np.geomspace(_LEAST_WAIST, 0.9 * max(float(distance.max()), 2.0 * _LEAST_WAIST), _NUM_LEVELS):
        count, labels = cv2.connectedComponents((distance > level).astype(np.uint8), connectivity=8)
        cores = [labels == k for k in range(1, count)]
        cores = [core for core in cores if level <= _WAIST * distance[core].max() and core.sum() >= 9]
        if len(cores) > len(best):
            best = cores
    return best
