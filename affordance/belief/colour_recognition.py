"""Which material a colour is of: one seen before, or one never seen.

A colour is measured with an error, and objects of one material differ by what is just noticeable. Around each colour
that was met before colours are normal in CIELAB; those of materials never met are anywhere among the colours a
picture can hold. Brightness may be measured worse than the rest, for it hangs on how a surface is turned to the
lamps: its error shifts a colour along the direction in which it changes as the light does. All known colours and
"never met" are equally probable before the colour is observed.
"""

from collections.abc import Sequence

import numpy as np

from affordance.arrays import Array
from affordance.objects.colour import JUST_NOTICEABLE, convert_to_lab

# Volume of the colours that sRGB holds, in cubic units of CIELAB (tests/belief/test_colour_recognition.py).
GAMUT_VOLUME = 8.2e5


def compute_colour_probabilities(
    colour: tuple[float, float, float],
    colour_sd: float,
    colours: Sequence[tuple[float, float, float]],
    lightness_sd: float = 0.0,
) -> Array:
    """Probabilities that a colour is each of K known colours, and, last, that it was never met, (K + 1,).

    Args:
        colour: As measured, in [0, 1].
        colour_sd: Standard deviation of the measurement in each direction of CIELAB.
        colours: Colours met before.
        lightness_sd: Standard deviation of a further error of its brightness, in units of L*.
    """
    spread = np.hypot(colour_sd, JUST_NOTICEABLE)
    differences = convert_to_lab(np.array(colours).reshape(-1, 3)) - convert_to_lab(np.array(colour))
    # Of the covariance spread^2 I + u u^T, with u one standard deviation of brightness.
    u = lightness_sd * _find_brightening(colour)
    ratio = float(u @ u) / spread**2
    distances = (differences**2).sum(axis=1) - (differences @ u) ** 2 / (spread**2 * (1.0 + ratio))
    log_densities = -0.5 * distances / spread**2 - 1.5 * np.log(2.0 * np.pi * spread**2) - 0.5 * np.log1p(ratio)
    log_weights = np.append(log_densities, -np.log(GAMUT_VOLUME))
    weights = np.exp(log_weights - log_weights.max())
    probabilities: Array = weights / weights.sum()
    return probabilities


def _find_brightening(colour: tuple[float, float, float]) -> Array:
    """How a colour changes in CIELAB as the light on it grows, for one unit of L*, (3,)."""
    dark = np.maximum(np.array(colour), 1.0 / 255.0) * 0.98
    change = convert_to_lab(dark) - convert_to_lab(0.99 * dark)
    direction: Array = change / change[0]
    return direction
