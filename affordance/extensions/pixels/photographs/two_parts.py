"""Division of an object into two solids along its longest axis, where width or colour changes.

Examples are hammers, spoons and brushes. Only long objects are divided because of colour, so that a label on a can is
not a separate part.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.photographs.superquadric import Evidence, FittedSolid, fit_solid
from affordance.objects.colour import convert_to_lab

_BINS = 24
_LEAST_BINS = 4  # smallest number of bins per part
_LEAST_PIXELS = 8  # smallest number of pixels per bin
# Smallest ratio of length to width of an object with two parts, and of an object whose parts differ only in colour.
_LONG, _VERY_LONG = 2.0, 3.0
# Smallest ratio of widths, and smallest colour difference between two parts, [CIELAB]. The difference is typical of
# clearly different materials. The median deviation of colours within each part must be less than half of it.
_WIDER, _OTHER_COLOUR = 1.5, 25.0
# Smallest log posterior odds for two solids. Nine additional parameters are penalised with half the logarithm of 60
# independent readings each (BIC).
_LEAST_ODDS = 0.5 * 9.0 * np.log(60.0)
_READINGS = 60.0
_LIFT_SD = 0.03  # SD of the height of a part above the table, [m]
_BESIDE = 5e-3  # distance of a part's end behind the cut, [m]


class _Cut(NamedTuple):
    place: float  # position along the longest axis from the middle, [m]
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
    """Fits two solids to an object, and compares them with one solid.

    Args:
        whole: Fit of one solid to the object.
        evidence: Evidence about the object in W.
        colour: Colour image, (height, width, 3).
        points: Positions of pixels in C, (height, width, 3), [m]; NaN without a depth reading.
        mask: Pixels of the object, (height, width).
        X_CW: Pose of the table frame, (4, 4).

    Returns: Two solids and their pixels if their colours differ enough or the evidence favours them over one solid;
        otherwise None.
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
        # The part ends at the cut, because the other part is behind it.
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
    """Finds the position with the largest change in width and colour, in units of their thresholds."""
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
        # The best cut has the smallest sum of absolute deviations within both sides.
        left = sum(np.nansum(np.abs(width[side] - np.nanmedian(width[side]))) for side in sides) / np.log(_WIDER)
        left += (
            sum(np.nansum(np.linalg.norm(tint[side] - mid, axis=1)) for side, mid in zip(sides, tints, strict=True))
            / _OTHER_COLOUR
        )
        if best is None or left < most:
            place = low + number / _BINS * (high - low)
            best, most = _Cut(float(place), float(np.exp(other - one)), difference), float(left)
    return best
