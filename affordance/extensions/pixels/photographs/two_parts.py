"""Splits an object into two solids where its width or colour changes.

The cut is along its longest axis.

A hammer, a spoon or a brush is two solids. A label on a tin is not: only long things are split by their colour.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.photographs.superquadric import Evidence, FittedSolid, fit_solid
from affordance.objects.colour import convert_to_lab

_BINS = 24
_LEAST_BINS = 4  # of a part
_LEAST_PIXELS = 8  # of a bin
# Length in widths from which a thing may have two parts, and from which these may differ in colour alone.
_LONG, _VERY_LONG = 2.0, 3.0
# Least ratio of the widths of two parts, and least difference of their colours, [CIELAB], which is as far apart as
# materials that look clearly different; a colour must also vary less than this within both parts.
_WIDER, _OTHER_COLOUR = 1.5, 25.0
# Log posterior odds of two solids over one from which evidence favours two: nine more numbers, each worth half the
# logarithm of 60 independent readings.
_LEAST_ODDS = 0.5 * 9.0 * np.log(60.0)
_READINGS = 60.0
_LIFT_SD = 0.03  # height at which a part is held up by the other, [m]
_BESIDE = 5e-3  # distance behind the cut where a part ends, [m]


class _Cut(NamedTuple):
    place: float  # along the longest axis, from the middle, [m]
    width_ratio: float
    colour_difference: float


def find_two_parts(
    whole: FittedSolid,
    evidence: Evidence,
    colour: NDArray[np.uint8],
    points: Array,
    mask: Mask,
    X_CW: Array,
) -> list[tuple[FittedSolid, Mask]] | None:
    """Finds two solids and their pixels if evidence favours them over one. Otherwise returns None.

    Args:
        whole: The object as one solid.
        evidence: Evidence of the picture about it, in W.
        colour: Colour picture, (height, width, 3).
        points: Positions that pixels show, in C, (height, width, 3), NaN where there is no reading, [m].
        mask: Pixels that show the object, (height, width).
        X_CW: Pose of the table's frame, (4, 4).
    """
    solid = whole.solid
    order = np.argsort(solid.semi_axes)[::-1]
    elongation = solid.semi_axes[order[0]] / solid.semi_axes[order[1]]
    if elongation < _LONG:
        return None
    axis, p_WS = solid.X_WS[:3, order[0]], solid.X_WS[:3, 3]
    there = mask & np.isfinite(points[..., 2])
    p_W = (points[there] - X_CW[:3, 3]) @ X_CW[:3, :3]
    along = (p_W - p_WS) @ axis
    across = (p_W - p_WS) @ solid.X_WS[:3, order[1]]
    cut = _find_cut(along, across, convert_to_lab(colour[there] / 255.0))
    if cut is None:
        return None
    is_wider = max(cut.width_ratio, 1.0 / cut.width_ratio) >= _WIDER
    is_other = elongation >= _VERY_LONG and cut.colour_difference >= _OTHER_COLOUR
    if not (is_wider or is_other):
        return None
    found, misfit = list[tuple[FittedSolid, Mask]](), 0.0
    for side in (-1.0, 1.0):
        own = side * ((evidence.surface - p_WS) @ axis - cut.place) > 0.0
        if own.sum() < _READINGS / 4.0:
            return None
        # Behind the cut is the other part: this one ends there.
        rest = evidence.surface[~own]
        behind = rest[side * ((rest - p_WS) @ axis - cut.place) < -_BESIDE]
        walls = np.repeat(behind[:, None], evidence.empty.shape[1], axis=1)
        fit = fit_solid(
            Evidence(evidence.surface[own], np.concatenate([evidence.empty, walls]), evidence.met[:0]), _LIFT_SD
        )
        pixels = there.copy()
        pixels[there] = side * (along - cut.place) > 0.0
        found.append((fit, pixels))
        misfit += fit.misfit * own.mean()
    gain = 0.5 * _READINGS * (whole.misfit - misfit)
    return found if is_other or gain > _LEAST_ODDS else None


def _find_cut(along: Array, across: Array, lab: Array) -> _Cut | None:
    """Finds the place of the largest change in width and colour. Units are the thresholds for another part."""
    low, high = np.percentile(along, [1.0, 99.0])
    index = np.floor(_BINS * (along - low) / (high - low)).astype(int)
    width, tint = np.full(_BINS, np.nan), np.full((_BINS, 3), np.nan)
    for number in range(_BINS):
        own = index == number
        if own.sum() >= _LEAST_PIXELS:
            width[number] = np.log(np.ptp(np.percentile(across[own], [3.0, 97.0])) + 1e-3)
            tint[number] = np.median(lab[own], axis=0)
    best, most = None, 0.0
    for number in range(_LEAST_BINS, _BINS - _LEAST_BINS + 1):
        sides = [np.arange(number), np.arange(number, _BINS)]
        if any(np.isfinite(width[side]).sum() < _LEAST_BINS for side in sides):
            continue
        one, other = (np.nanmedian(width[side]) for side in sides)
        tints = [np.nanmedian(tint[side], axis=0) for side in sides]
        spread = max(
            np.nanmedian(np.linalg.norm(tint[side] - mid, axis=1)) for side, mid in zip(sides, tints, strict=True)
        )
        difference = float(np.linalg.norm(tints[1] - tints[0])) if spread < 0.5 * _OTHER_COLOUR else 0.0
        # Sums of absolute deviations left within the sides; the best cut leaves least.
        left = sum(np.nansum(np.abs(width[side] - np.nanmedian(width[side]))) for side in sides) / np.log(_WIDER)
        left += (
            sum(np.nansum(np.linalg.norm(tint[side] - mid, axis=1)) for side, mid in zip(sides, tints, strict=True))
            / _OTHER_COLOUR
        )
        if best is None or left < most:
            place = low + number / _BINS * (high - low)
            best, most = _Cut(float(place), float(np.exp(other - one)), difference), float(left)
    return best
