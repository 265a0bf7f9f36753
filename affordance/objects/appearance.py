"""Appearance of an object, by which it is recognised: colour, sizes and position of each part.

Memory cannot distinguish objects of equal appearance. It therefore recognises a decoy as the object that it imitates.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from affordance.objects.colour import Colour, is_same_colour

# Lengths that differ by less than this fraction cannot be distinguished by eye. It is the Weber fraction of line
# length (Teghtsoonian 1971, Psychological Review 78:71-80; from memory, not checked).
SAME_LENGTH = 0.029
# In one of 200 pairs, two measurements of the same length differ by more than this many standard deviations.
_MEASUREMENT_MARGIN = 4.0


class PartAppearance(NamedTuple):
    """Appearance of one part, with standard deviations (SD) of its measurement errors."""

    colour: Colour  # red, green and blue in [0, 1]
    sizes: tuple[float, ...]  # axis lengths in any order, [m]
    position: tuple[float, float, float]  # centre in the tool's frame T, [m]
    colour_sd: float = 0.0  # SD of the colour in each direction of CIELAB; 0 if it is exact
    size_sd: float = 0.0  # SD of each size, as a fraction of it
    position_sd: float = 0.0  # SD of each coordinate, [m]
    lightness_sd: float = 0.0  # SD of an additional error due to illumination, in units of L*


type Appearance = tuple[PartAppearance, ...]


def is_same_object(one: Sequence[PartAppearance], other: Sequence[PartAppearance]) -> bool:
    """Returns True if two appearances can belong to the same object.

    Every part of one object must match a different part of the other. Parts match if they have the same colour, and
    if their sizes and positions differ by no more than the measurement error plus the resolution of the eye. The
    number of comparisons is n^2 for n parts.
    """
    if len(one) != len(other):
        return False
    extent = max(max(part.sizes) + math.hypot(*part.position) for part in one)
    unmatched = list(other)
    for part in one:
        match = next((candidate for candidate in unmatched if _is_same_part(part, candidate, extent)), None)
        if match is None:
            return False
        unmatched.remove(match)
    return True


def _is_same_part(one: PartAppearance, other: PartAppearance, extent: float) -> bool:
    """Returns True if two parts match.

    The tolerance of positions is proportional to ``extent``, the object's length, [m].
    """
    if len(one.sizes) != len(other.sizes):
        return False
    # Each object is compared with all stored objects: plain numbers are several times faster than short arrays.
    tolerance = SAME_LENGTH + _MEASUREMENT_MARGIN * max(one.size_sd, other.size_sd)
    for a, b in zip(sorted(one.sizes), sorted(other.sizes), strict=True):
        if not abs(a - b) <= tolerance * min(a, b):
            return False
    tolerance = SAME_LENGTH * extent + _MEASUREMENT_MARGIN * max(one.position_sd, other.position_sd)
    is_close = all(abs(a - b) <= tolerance for a, b in zip(one.position, other.position, strict=True))
    return is_close and is_same_colour(one.colour, other.colour)
