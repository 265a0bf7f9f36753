"""Belief about one density in a few numbers."""

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from affordance.belief.density_belief import DensityBelief, show_density

_FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)
# Nodes by which the variance is integrated over a standard normal variable; the outermost lies at 5.5.
_NUM_NODES = 12


class Density(NamedTuple):
    """Mean, SD and percentiles of the belief about the mean density of objects of one colour, [kg/m^3]."""

    mean: float
    sd: float
    p05: float
    p25: float
    median: float
    p75: float
    p95: float

    def __repr__(self) -> str:
        interval = f"90 % from {show_density(self.p05)} to {show_density(self.p95)}"
        return f"Density({show_density(self.mean)} ± {show_density(self.sd)} kg/m^3, {interval})"


def summarise_density(belief: DensityBelief, index: int) -> Density:
    """Summarises the belief about one of several densities, [kg/m^3]."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NUM_NODES)
    percentiles = belief.compute_percentiles([*_FRACTIONS, *ndtr(nodes)])[:, index]
    mean = float(belief.compute_mean()[index])
    squares = (percentiles[len(_FRACTIONS) :] - mean) ** 2
    sd = float(np.sqrt(weights @ squares / weights.sum()))
    p05, p25, median, p75, p95 = (float(value) for value in percentiles[: len(_FRACTIONS)])
    return Density(mean, sd, p05, p25, median, p75, p95)
