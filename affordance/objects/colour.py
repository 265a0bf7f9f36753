"""Perceived colours, and their shading-invariant components.

Colours are red, green and blue in [0, 1] as stored in a picture (sRGB). Perceived colours are CIELAB: lightness L*
and the opponent coordinates a* and b*, in which equal distances look about equally different. Shading multiplies the
light that a surface reflects. Because pictures store a power of the light, shading also multiplies the stored red,
green and blue by a common factor.
"""

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

type Colour = tuple[float, float, float]

# Two colours that differ by less than this in CIELAB are indistinguishable by eye (Mahy, Van Eycken and Oosterlinck
# 1994, Color Research and Application 19:105-121).
JUST_NOTICEABLE = 2.3
COLOUR_FORM = "must be red, green and blue in hexadecimal, as '#b5a642'"


def is_colour(text: str) -> bool:
    """Returns True if a text has the form of a hexadecimal colour."""
    return re.fullmatch("#[0-9a-fA-F]{6}", text) is not None


def parse_colour(text: str) -> Colour:
    """Parses six hexadecimal digits to red, green and blue in [0, 1]."""
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def convert_to_lab(colours: NDArray[np.floating]) -> Array:
    """Converts colours in [0, 1], (..., 3), to CIELAB coordinates L*, a*, b*, (..., 3)."""
    if not np.size(colours):  # OpenCV rejects it
        return np.zeros(np.shape(colours))
    import cv2  # imported here because most commands need no colours

    flat = np.ascontiguousarray(colours, dtype=np.float32).reshape(1, -1, 3)
    return cv2.cvtColor(flat, cv2.COLOR_RGB2Lab).astype(float).reshape(np.shape(colours))


def compute_tints(colours: NDArray[np.floating]) -> Array:
    """Computes shading-invariant coordinates, (..., 2), of colours, (..., 3).

    The coordinates are a* and b* at full brightness.

    At full brightness the largest channel is just saturated.
    """
    brightest = np.maximum(colours.max(axis=-1, keepdims=True), 1.0 / 255.0)
    return convert_to_lab(colours / brightest)[..., 1:]


# Two colours are the same if they differ by at most this in every channel, in [0, 1]: 5 of 255 steps, plus half a
# step so that rounding does not matter.
SAME_COLOUR = 5.5 / 255


def is_same_colour(one: Colour, other: Colour) -> bool:
    """Returns True if two colours are indistinguishable."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) <= SAME_COLOUR


def find_nearest_colour(colour: Colour, colours: Mapping[str, Colour]) -> str:
    """Finds the name of the most similar of at least one colour."""
    lab = convert_to_lab(np.array(colour))
    return min(colours, key=lambda name: float(np.linalg.norm(convert_to_lab(np.array(colours[name])) - lab)))


def show_colour(colour: Colour) -> str:
    """Formats a colour in hexadecimal, such as '#d4a017'."""
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)
