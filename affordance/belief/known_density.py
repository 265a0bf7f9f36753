"""Summary of a memory's belief about the density of one material."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import ndtr

from affordance.belief.density_belief import Density, DensityBelief
from affordance.exceptions import BadArgumentError
from affordance.files.html_table import build_table
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.objects.material import Material, MaterialLike
from affordance.objects.materials import find_colour

_FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)
# Nodes by which the variance is integrated over a standard normal variable; the outermost lies at 5.5.
_NUM_NODES = 12


def describe_density(
    colours: Sequence[Colour],
    belief: DensityBelief,
    material: MaterialLike,
    materials: Mapping[str, Material] | None = None,
) -> Density:
    """Summarises the belief about a material that was met.

    Args:
        colours: Colours that were met.
        belief: Belief about the colours' mean densities, in the same order.
        material: Name of a material, a material, or a colour.
        materials: Materials by name; None for those of the package.

    Raises:
        BadArgumentError: The material does not exist, or no object of its colour was met.
    """
    wanted = find_colour(material, materials)
    found = [index for index, colour in enumerate(colours) if is_same_colour(colour, wanted)]
    if not found:
        met = ", ".join(show_colour(colour) for colour in colours) or "none"
        name = repr(material) if isinstance(material, str) else show_colour(wanted)
        problem = f"is {name}, of which nothing was met; colours met are {met}"
        raise BadArgumentError("material", "", problem)
    index = found[0]
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NUM_NODES)
    percentiles = belief.compute_percentiles([*_FRACTIONS, *ndtr(nodes)])[:, index]
    mean = float(belief.compute_mean()[index])
    squares = (percentiles[len(_FRACTIONS) :] - mean) ** 2
    sd = float(np.sqrt(weights @ squares / weights.sum()))
    p05, p25, median, p75, p95 = (float(value) for value in percentiles[: len(_FRACTIONS)])
    return Density(mean, sd, p05, p25, median, p75, p95)


def tabulate_densities(caption: str, colours: Sequence[Colour], belief: DensityBelief) -> str:
    """Builds an HTML table of the densities of all colours."""
    low, median, high = belief.compute_percentiles([0.05, 0.5, 0.95]) if colours else np.zeros((3, 0))
    rows = [
        [show_colour(colour), f"{median[i]:.4g}", f"{low[i]:.4g} to {high[i]:.4g}"]
        for i, colour in enumerate(colours)
    ]
    return build_table(caption, ["colour", "median (kg/m^3)", "90 % interval"], rows)
