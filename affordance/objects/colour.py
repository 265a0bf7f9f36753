"""Comparison of colours as they are perceived, with and without the effect of shading.

A colour is red, green and blue in [0, 1], as stored in a picture (sRGB). Perceived differences are distances in
CIELAB, whose coordinates are lightness L* and the opponent colours a* and b*. Shading multiplies the light that a
surface reflects. Pictures store a power of the light, so shading also multiplies the stored channels by a common
factor.
"""

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

type Colour = tuple[float, float, float]

# Colours that differ by less than this in CIELAB cannot be distinguished by eye (Mahy, Van Eycken and Oosterlinck
# 1994, Color Research and Application 19:105-121).
JUST_NOTICEABLE = 2.3
COLOUR_FORM = "must be red, green and blue in hexadecimal, as '#b5a642'"


def is_colour(text: str) -> bool:
    """Returns True if a text is a colour in hexadecimal."""
    return re.fullmatch("#[0-9a-fA-F]{6}", text) is not None


def parse_colour(text: str) -> Colour:
    """Converts a colour from six hexadecimal digits to red, green and blue in [0, 1]."""
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def convert_to_lab(colours: NDArray[np.floating]) -> Array:
    """Converts colours in [0, 1], (..., 3), to CIELAB coordinates L*, a* and b*, (..., 3)."""
    if not np.size(colours):  # OpenCV rejects empty arrays
        return np.zeros(np.shape(colours))
    import cv2  # imported here because most commands need no colours

    flat = np.ascontiguousarray(colours, dtype=np.float32).reshape(1, -1, 3)
    return cv2.cvtColor(flat, cv2.COLOR_RGB2Lab).astype(float).reshape(np.shape(colours))


def compute_tints(colours: NDArray[np.floating]) -> Array:
    """Computes coordinates of colours, (..., 3), that do not change with shading.

    Returns:
        CIELAB's a* and b*, (..., 2), after each colour is brightened until its largest channel is 1.
    """
    brightest = np.maximum(colours.max(axis=-1, keepdims=True), 1.0 / 255.0)
    return convert_to_lab(colours / brightest)[..., 1:]


# Largest difference in any channel between equal colours: 5 of 255 steps, plus half a step for rounding.
SAME_COLOUR = 5.5 / 255


def is_same_colour(one: Colour, other: Colour) -> bool:
    """Returns True if two colours differ by at most SAME_COLOUR in each channel."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) <= SAME_COLOUR


def find_nearest_colour(colour: Colour, colours: Mapping[str, Colour]) -> str:
    """Returns the name of the most similar colour. There must be at least one colour."""
    lab = convert_to_lab(np.array(colour))
    return min(colours, key=lambda name: float(np.linalg.norm(convert_to_lab(np.array(colours[name])) - lab)))


def show_colour(colour: Colour) -> str:
    """Formats a colour in hexadecimal, such as '#d4a017'."""
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)
