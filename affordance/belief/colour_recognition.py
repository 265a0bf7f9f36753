"""Which material a colour is of: one seen before, or one never seen.

A colour is measured with an error, and objects of one material differ by what is just noticeable. Around each colour
that was met before colours are normal in CIELAB; those of materials never met are anywhere among the colours a
picture can hold. All known colours and "never met" are equally probable before the colour is observed.
"""

from collections.abc import Sequence

import numpy as np

from affordance.arrays import Array
from affordance.objects.colour import JUST_NOTICEABLE, convert_to_lab

# Volume of the colours that sRGB holds, in cubic units of CIELAB (tests/belief/test_colour_recognition.py).
GAMUT_VOLUME = 8.2e5


def compute_colour_probabilities(
    colour: tuple[float, float, float], colour_sd: float, colours: Sequence[tuple[float, float, float]]
) -> Array:
    """Probabilities that a colour is each of K known colours, and, last, that it was never met, (K + 1,).

    Args:
        colour: As measured, in [0, 1].
        colour_sd: Standard deviation of the measurement in each direction of CIELAB.
        colours: Colours met before.
    """
    spread = np.hypot(colour_sd, JUST_NOTICEABLE)
    differences = convert_to_lab(np.array(colours).reshape(-1, 3)) - convert_to_lab(np.array(colour))
    log_densities = -0.5 * (differences**2).sum(axis=1) / spread**2 - 1.5 * np.log(2.0 * np.pi * spread**2)
    log_weights = np.append(log_densities, -np.log(GAMUT_VOLUME))
    weights = np.exp(log_weights - log_weights.max())
    probabilities: Array = weights / weights.sum()
    return probabilities
