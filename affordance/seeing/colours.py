"""Colours as they are perceived, and what of them shading leaves alone.

Colours are red, green and blue in [0, 1] (sRGB); perceived colours are CIELAB: lightness L* and the two opponent
coordinates a* and b*, in which equal distances look about equally different. A shade multiplies the light that a
surface sends back, and so L* + 16, a* and b* all by the cube root of it: their ratios stay.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from affordance.seeing.picture import Array

# Two colours that differ by less than this in CIELAB cannot be told apart by eye (Mahy, Van Eycken and Oosterlinck
# 1994, Color Research and Application 19:105-121).
JUST_NOTICEABLE = 2.3
# At this lightness a tint has the length of the colour's own a* and b*.
_REFERENCE_LIGHTNESS = 50.0


def convert_to_lab(colours: NDArray[np.floating]) -> Array:
    """CIELAB coordinates L*, a*, b* of colours in [0, 1], shape (..., 3)."""
    flat = np.ascontiguousarray(colours, dtype=np.float32).reshape(1, -1, 3)
    lab: Array = cv2.cvtColor(flat, cv2.COLOR_RGB2Lab).astype(float).reshape(np.shape(colours))
    return lab


def compute_tints(lab: Array) -> Array:
    """What shading leaves of colours L*, a*, b*, (..., 3): a* and b* as they were at the reference lightness, (..., 2)."""
    tints: Array = lab[..., 1:] * (_REFERENCE_LIGHTNESS + 16.0) / (lab[..., :1] + 16.0)
    return tints
