"""Recognises materials by colour, with Bayes' rule over all known colours and a new colour.

The measured colour deviates from the material's colour by a measurement error and by a just noticeable difference
between objects. Measurements of a known colour are normally distributed in CIELAB. New colours are uniformly
distributed over the sRGB gamut. Illumination depends on the orientation of a surface, so a larger error is allowed in
the direction in which the colour changes with illumination. A priori, each known colour and a new colour are equally
probable.
"""

from collections.abc import Sequence

import numpy as np

from affordance.arrays import Array
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import JUST_NOTICEABLE, Colour, convert_to_lab, is_same_colour

# Volume of the colours that sRGB can represent, in cubic units of CIELAB (tests/belief/test_colour_recognition.py).
GAMUT_VOLUME = 8.2e5
# Probability above which a colour counts as certain, and all other colours are ignored.
CERTAIN = 0.95
# L* below which CIELAB coordinates are linear in luminance.
_LINEAR = 8.0


def find_colour_index(colours: Sequence[Colour], colour: Colour) -> int | None:
    """Finds the index of the first known colour that looks the same; None if there is no such colour."""
    return next((index for index, known in enumerate(colours) if is_same_colour(known, colour)), None)


def find_material(part: PartAppearance, colours: Sequence[Colour]) -> int | None:
    """Finds the index of a part's material by its colour; None if no known colour is certain."""
    if part.colour_sd == 0.0:
        return find_colour_index(colours, part.colour)
    probabilities = compute_colour_probabilities(part.colour, part.colour_sd, colours, part.lightness_sd)
    best = int(np.argmax(probabilities))
    return best if best < len(colours) and probabilities[best] >= CERTAIN else None


def compute_colour_probabilities(
    colour: Colour, colour_sd: float, colours: Sequence[Colour], lightness_sd: float = 0.0
) -> Array:
    """Computes the probabilities of K known colours and, last, of a new colour, (K + 1,).

    Args:
        colour: Measured colour.
        colour_sd: Standard deviation of the measurement error in each direction of CIELAB.
        colours: The K known colours.
        lightness_sd: Standard deviation of an additional error due to illumination, in units of L*.
    """
    spread = np.hypot(colour_sd, JUST_NOTICEABLE)
    differences = convert_to_lab(np.array(colours).reshape(-1, 3)) - convert_to_lab(np.array(colour))
    # The covariance is spread^2 I + u u^T, where u is the change by one SD of illumination.
    u = lightness_sd * _find_brightening(colour)
    ratio = float(u @ u) / spread**2
    distances = (differences**2).sum(axis=1) - (differences @ u) ** 2 / (spread**2 * (1.0 + ratio))
    log_densities = -0.5 * distances / spread**2 - 1.5 * np.log(2.0 * np.pi * spread**2) - 0.5 * np.log1p(ratio)
    log_weights = np.append(log_densities, -np.log(GAMUT_VOLUME))
    weights = np.exp(log_weights - log_weights.max())
    probabilities: Array = weights / weights.sum()
    return probabilities


def _find_brightening(colour: Colour) -> Array:
    """Computes the derivative of a colour in CIELAB with respect to L* under changing illumination, (3,).

    L* + 16, a* and b* are proportional to the cube root of the luminance. If L* is below 8, L*, a* and b* are
    proportional to the luminance (CIE 15:2004).
    """
    lab = convert_to_lab(np.maximum(np.array(colour), 1.0 / 255.0))
    lightness = lab[0] + 16.0 if lab[0] > _LINEAR else lab[0]
    return np.array([1.0, *lab[1:] / lightness])
