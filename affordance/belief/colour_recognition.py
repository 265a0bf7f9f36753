"""Recognises a material by its colour, which is a known or a new colour.

A colour is measured with an error, and objects of one material differ by a just noticeable difference. Measurements
of a known colour are normal in CIELAB; new colours are uniform over the colours that a picture can contain. The error
along the brightness may be larger, because brightness depends on how a surface is turned to the lamps: it shifts a
colour in the direction in which the colour changes with the light. Before the measurement all known colours and "new"
are equally probable.
"""

from collections.abc import Sequence

import numpy as np

from affordance.arrays import Array
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import JUST_NOTICEABLE, Colour, convert_to_lab, is_same_colour

# Volume of the colours that sRGB can represent, in cubic units of CIELAB (tests/belief/test_colour_recognition.py).
GAMUT_VOLUME = 8.2e5
# Probability above which a colour counts as certain, and the others are ignored.
CERTAIN = 0.95
# L* below which CIELAB coordinates are linear in the light.
_LINEAR = 8.0


def find_colour_index(colours: Sequence[Colour], colour: Colour) -> int | None:
    """Finds the index of the first known colour that looks the same, or None."""
    return next((index for index, known in enumerate(colours) if is_same_colour(known, colour)), None)


def find_material(part: PartAppearance, colours: Sequence[Colour]) -> int | None:
    """Finds the index of a part's material by its colour. Returns None if no colour is recognised with certainty."""
    if part.colour_sd == 0.0:
        return find_colour_index(colours, part.colour)
    probabilities = compute_colour_probabilities(part.colour, part.colour_sd, colours, part.lightness_sd)
    best = int(np.argmax(probabilities))
    return best if best < len(colours) and probabilities[best] >= CERTAIN else None


def compute_colour_probabilities(
    colour: Colour, colour_sd: float, colours: Sequence[Colour], lightness_sd: float = 0.0
) -> Array:
    """Computes the probability of each of K known colours and of a new one, (K + 1,).

    Args:
        colour: Measured colour.
        colour_sd: Standard deviation of the measurement error in each direction of CIELAB.
        colours: Known colours, K of them.
        lightness_sd: Standard deviation of a further error along the brightness, in units of L*.
    """
    spread = np.hypot(colour_sd, JUST_NOTICEABLE)
    differences = convert_to_lab(np.array(colours).reshape(-1, 3)) - convert_to_lab(np.array(colour))
    # The covariance is spread^2 I + u u^T, where u is one standard deviation of brightness.
    u = lightness_sd * _find_brightening(colour)
    ratio = float(u @ u) / spread**2
    distances = (differences**2).sum(axis=1) - (differences @ u) ** 2 / (spread**2 * (1.0 + ratio))
    log_densities = -0.5 * distances / spread**2 - 1.5 * np.log(2.0 * np.pi * spread**2) - 0.5 * np.log1p(ratio)
    log_weights = np.append(log_densities, -np.log(GAMUT_VOLUME))
    weights = np.exp(log_weights - log_weights.max())
    probabilities: Array = weights / weights.sum()
    return probabilities


def _find_brightening(colour: Colour) -> Array:
    """Computes how a colour changes in CIELAB with the light, per unit of L*, shape (3,).

    L* + 16, a* and b* grow with the cube root of the light; where L* is below 8, L*, a* and b* are proportional to it
    (CIE 15:2004). The derivative is thus exact, without a difference of rounded colours.
    """
    lab = convert_to_lab(np.maximum(np.array(colour), 1.0 / 255.0))
    lightness = lab[0] + 16.0 if lab[0] > _LINEAR else lab[0]
    return np.array([1.0, *lab[1:] / lightness])
