"""Which pixels show the object, and which of its parts.

What stands out from the stand is the object: its depth is less. Within it, regions of one tint are parts, whatever
their shade; a region of one tint that has a waist is several parts of one colour. Labels as a renderer knows them are
not used.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.exceptions import (
    NoDepthError,
    NothingSeenError,
    OneColourError,
    OutOfViewError,
    TooSmallError,
    UnusablePictureError,
)
from affordance.objects.colour import compute_tints
from affordance.vision.pixels.rgbd import Labels, Mask, Picture
from affordance.vision.pixels.sensor_noise import SensorNoise

# A fit of nine numbers wants several times as many readings inside the rim, whose band is three pixels wide: a disc
# of twelve pixels across.
MIN_PIXELS = 110
# Depth that is this many standard deviations nearer than the stand is not the stand's: one pixel in 30,000 errs, and
# such specks are removed.
_NUM_SDS = 4.0
# What the stand's own depth is off by at most, beside its noise: rounding of a renderer or a calibration, [m].
_STAND_ERROR = 1e-3
# Fewer readings than this part of the picture are none.
_MIN_READABLE = 0.5
# Sides of the median and the mean filter that take the noise off colours, and how far from a pixel both reach: the
# rest of the stand's colour is that far inside the object, [pixels].
_MEDIAN_SIDE, _MEAN_SIDE, _SMOOTHING = 5, 3, 3
# Tints further apart than this are of two materials: colours ten units apart differ to any eye. Bins of the
# histogram in which the most frequent tints are found.
_TINT_RADIUS, _TINT_BIN = 10.0, 2.0
# In less light than this, of what saturates a channel, that radius is less than four standard deviations of what
# noise does to the tint of a smoothed grey (0.7 over the root of the light), and grows with it.
_LIT = 0.08
# Strips of mixed colours between two parts are narrower than this, and are no part, [pixels].
_STRIP = 5
# A region has a waist if it falls apart where its distance from the rim is more than this part of each piece's own.
_WAIST = 0.7
# Distances from the rim at which waists are sought: from this many pixels on, so many of them.
_LEAST_WAIST, _NUM_LEVELS = 1.5, 24
_UNKNOWN = -1


class Segmentation(NamedTuple):
    """What the picture shows.

    Attributes:
        labels: Number of the part each pixel shows, -1 where it shows none, (height, width).
        num_parts: How many parts there are.
    """

    labels: Labels
    num_parts: int


def check_picture(picture: Picture) -> None:
    """Rejects what is no picture.

    Raises:
        UnusablePictureError: Colour and depth do not fit together, or are too small.
        NoDepthError: Depth is no number, or there is too little of it.
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
        raise NoDepthError(f"{count} of {depth.size} depth readings are not finite, all must be", *picture)
    readable = float((depth > 0.0).mean())
    if readable < _MIN_READABLE:
        reason = f"{100 * readable:.0f} % of the picture has depth, must be at least {100 * _MIN_READABLE:.0f} %"
        raise NoDepthError(reason, *picture)
    if (colour == colour[0, 0]).all():
        raise OneColourError(f"all pixels have the colour {tuple(int(c) for c in colour[0, 0])}", *picture)


def segment(picture: Picture, stand_depth: float, noise: SensorNoise) -> Segmentation:
    """Finds the parts of the object.

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
        TooSmallError: It, or one of its parts, covers too few pixels.
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
        reason = f"no {MIN_PIXELS // 4} pixels of one tint lie together in what is nearer than the stand"
        raise TooSmallError(f"{reason}, beside its rim of {_SMOOTHING} pixels", *picture)
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
    """Finds what stands out from the stand, (height, width); arguments and errors are those of segment."""
    threshold = (
        stand_depth - _STAND_ERROR - _NUM_SDS * float(noise.compute_axial_sd(np.array(stand_depth), np.zeros(())))
    )
    # Where there is no reading the surface is turned far away, as an object's is near its outline, the stand's never.
    near = picture.depth < threshold
    mask = cv2.medianBlur(near.astype(np.uint8), 3)
    num_regions, regions, statistics, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    sizes = statistics[1:, cv2.CC_STAT_AREA]
    if num_regions < 2:
        raise NothingSeenError(f"nothing is nearer than the stand, {stand_depth:g} m from the camera", *picture)
    large = 1 + np.flatnonzero(sizes >= MIN_PIXELS)
    if not len(large):
        reason = f"what is nearer than the stand covers {sizes.max()} pixels, must cover at least {MIN_PIXELS}"
        raise TooSmallError(reason, *picture)
    found: Mask = np.isin(regions, large)
    edge = np.concatenate([found[0], found[-1], found[:, 0], found[:, -1]])
    if edge.any():
        raise OutOfViewError(
            f"the object covers {int(edge.sum())} pixels of the picture's edge, must cover none", *picture
        )
    return found


def find_window(mask: Mask, room: int) -> tuple[slice, slice]:
    """Rows and columns around a mask that is not empty, with room on all sides as far as there is any, [pixels]."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return (
        slice(max(0, int(rows[0]) - room), int(rows[-1]) + room + 1),
        slice(max(0, int(columns[0]) - room), int(columns[-1]) + room + 1),
    )


def _split_by_tint(mask: Mask, colour: NDArray[Any]) -> list[Mask]:
    """Regions of one tint each: tints are found one after the other, the most frequent first, in good light first.

    There is none if what is seen is so small or slim that the stand's colour is mixed into all of it.
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
        mode = _find_mode(points[pool])
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
        # Between two parts colours mix; such a strip is no part.
        one = cv2.morphologyEx(
            (seeds == number).astype(np.uint8), cv2.MORPH_OPEN, np.ones((_STRIP, _STRIP), np.uint8)
        )
        count, pieces, statistics, _ = cv2.connectedComponentsWithStats(one, connectivity=4)
        regions += [pieces == k for k in range(1, count) if statistics[k, cv2.CC_STAT_AREA] >= MIN_PIXELS // 4]
    return _grow(regions, mask) if regions else []


def _find_mode(points: Array) -> Array:
    """The most frequent tint, (2,)."""
    low, high = points.min(axis=0), points.max(axis=0)
    shape = np.maximum(1, np.ceil((high - low) / _TINT_BIN)).astype(int) + 1
    index = ((points - low) / _TINT_BIN).astype(int)
    counts = np.zeros(shape)
    np.add.at(counts, tuple(index.T), 1.0)
    peak = np.unravel_index(np.argmax(cv2.GaussianBlur(counts, (5, 5), 1.0)), counts.shape)
    mode: Array = low + (np.array(peak) + 0.5) * _TINT_BIN
    return mode


def _grow(regions: list[Mask], mask: Mask) -> list[Mask]:
    """Gives every pixel of a mask to the nearest of the regions inside it."""
    seeds = np.zeros(mask.shape, dtype=np.int32)
    for number, region in enumerate(regions):
        seeds[region & mask] = number + 1
    free = (seeds == 0).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    owner = np.zeros(int(nearest.max()) + 1, dtype=np.int32)
    owner[nearest[free == 0]] = seeds[free == 0]
    owners = owner[nearest]
    return [mask & (owners == number + 1) for number in range(len(regions))]


def _split_at_waists(region: Mask) -> list[Mask]:
    """The convex pieces that a region is made of; itself if it has no waist."""
    window = find_window(region, room=2)
    small = region[window].astype(np.uint8)
    distance = cv2.distanceTransform(small, cv2.DIST_L2, 5)
    cores = _find_cores(distance)
    if len(cores) < 2:
        return [region]
    markers = np.zeros(small.shape, dtype=np.int32)
    for number, core in enumerate(cores):
        markers[core] = number + 1
    # The nearest core, counted in its own radii: two touching ellipsoids of unequal thickness part at their waist.
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
    """Cores of the pieces of a region, by the distance of its pixels from its rim."""
    best: list[Mask] = []
    for level in np.geomspace(_LEAST_WAIST, 0.9 * max(float(distance.max()), 2.0 * _LEAST_WAIST), _NUM_LEVELS):
        count, labels = cv2.connectedComponents((distance > level).astype(np.uint8), connectivity=8)
        cores = [labels == k for k in range(1, count)]
        cores = [core for core in cores if level <= _WAIST * distance[core].max() and core.sum() >= 9]
        if len(cores) > len(best):
            best = cores
    return best
