"""Belief about one object, and the interface of all learners.

A memory is immutable: learning returns another one. Systems, simulations and choices use the Protocol ``Memory``
only; the initial memory determines the learner of an observer (``MaterialMemory``, one density for each colour, or
``KindMemory``, one or more kinds for each colour).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
from scipy.special import ndtr

from affordance.arrays import Array
from affordance.belief.colour_recognition import find_colour_index
from affordance.belief.density_belief import DensityBelief, FindLikelihood, Prior, show_density
from affordance.belief.likelihood import Likelihood
from affordance.exceptions import BadArgumentError
from affordance.files.html_table import build_table
from affordance.objects.appearance import Appearance, PartAppearance
from affordance.objects.colour import Colour, show_colour
from affordance.objects.inertia import Geometry
from affordance.objects.materials import Material, MaterialLike, find_colour

_FRACTIONS = (0.05, 0.25, 0.5, 0.75, 0.95)
# Nodes by which the variance is integrated over a standard normal variable; the outermost lies at 5.5.
_NUM_NODES = 12


class FeltObject(NamedTuple):
    """Object that was held, with the likelihoods of the densities that were felt."""

    colours: tuple[Colour, ...]  # m of them
    own: Likelihood  # of its own densities, of size m in the order of the colours
    shared: Likelihood  # of its materials' means, which the memory has learned, in the same order
    appearance: Appearance = ()  # with these colours

    @classmethod
    def of(
        cls, colours: tuple[Colour, ...], own: Likelihood | None, prior: Prior, appearance: Appearance
    ) -> "FeltObject | None":
        """Returns the object with its own likelihood; None if nothing was felt."""
        if own is None:
            return None
        return cls(colours, own, own.marginalise_deviation(prior.deviation_sd), appearance)


class Recollection[M](NamedTuple):
    """Recalled belief about an object that is seen, with a memory that includes all of its colours."""

    memory: M
    densities: DensityBelief
    columns: tuple[int, ...]  # index of each part's density among those of the object
    # Likelihoods that were felt in earlier holds of this object; None if it was never held.
    felt: FeltObject | None = None


class Lesson[M](NamedTuple):
    """Result of learning from a trial: memory, and belief about the object's own densities with their likelihood."""

    memory: M
    densities: DensityBelief
    likelihood: Likelihood


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


@runtime_checkable
class Memory(Protocol):
    """Memory of an observer: beliefs about materials and objects, and their updates."""

    @property
    def colours(self) -> tuple[Colour, ...]:
        """Known colours, in the order they were met."""

    @property
    def belief(self) -> DensityBelief:
        """Belief about the mean density of new objects of each colour."""

    def density(self, material: MaterialLike, materials: Mapping[str, Material] | None = None) -> Density:
        """Returns the belief about a material that was met: mean, standard deviation and percentiles, [kg/m^3].

        Args:
            material: Name of a material, a material, or a colour.
            materials: Materials by name; None for those of the package.

        Raises:
            BadArgumentError: The material does not exist, or no object of its colour was met.
        """
        colour = find_colour(material, materials)
        index = find_colour_index(self.colours, colour)
        if index is None:
            met = ", ".join(map(show_colour, self.colours)) or "none"
            name = repr(material) if isinstance(material, str) else show_colour(colour)
            problem = f"is {name}, of which no object was met; colours met are {met}"
            raise BadArgumentError("material", "", problem)
        nodes, weights = np.polynomial.hermite_e.hermegauss(_NUM_NODES)
        percentiles = self.belief.compute_percentiles([*_FRACTIONS, *ndtr(nodes)])[:, index]
        mean = float(self.belief.compute_mean()[index])
        squares = (percentiles[len(_FRACTIONS) :] - mean) ** 2
        sd = float(np.sqrt(weights @ squares / weights.sum()))
        p05, p25, median, p75, p95 = (float(value) for value in percentiles[: len(_FRACTIONS)])
        return Density(mean, sd, p05, p25, median, p75, p95)

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> Self:
        """Returns the memory with the prior added for each new colour."""

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> tuple[Self, int]:
        """Returns the memory with a measured colour, and the index of the known colour that represents it.

        Errors of the measurement have the standard deviation colour_sd in each direction of CIELAB, 0 if it is exact,
        and along the brightness another one of lightness_sd, in units of L*. The prior is that of materials never
        met.
        """

    def restrict_to(self, colours: Sequence[Colour]) -> Self:
        """Returns the memory of these known colours only, in their order."""

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> Recollection[Self]:
        """Recalls the belief about an object of this appearance; the prior is that of materials never met."""

    def learn(self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float) -> Lesson[Self]:
        """Learns from a trial with the object recalled last.

        The densities are those of ``recall``; objects of a material scatter about its mean by deviation_sd, [kg/m^3].
        """


def tabulate_densities(caption: str, memory: Memory) -> str:
    """Builds an HTML table of the densities of all colours."""
    low, median, high = memory.belief.compute_percentiles([0.05, 0.5, 0.95]) if memory.colours else np.zeros((3, 0))
    rows = [
        [show_colour(colour), f"{median[i]:.4g}", f"{low[i]:.4g} to {high[i]:.4g}"]
        for i, colour in enumerate(memory.colours)
    ]
    return build_table(caption, ["colour", "median (kg/m^3)", "90 % interval"], rows)


@dataclass(frozen=True)
class ObjectBelief:
    """Belief about the object at hand: memory of all materials, densities of this object, and its geometry.

    Densities are in the order of Phi's columns; columns of materials that are not in the object are zero.
    """

    memory: Memory
    densities: DensityBelief
    geometry: Geometry

    def compute_parameters(self, rho: Array) -> Array:
        """Computes the inertial parameters pi = Phi rho, shape (10,), or (N, 10) for rho of shape (N, M)."""
        return rho @ self.geometry.Phi.T

    def draw_parameters(self, rng: np.random.Generator, num_samples: int) -> Array:
        """Draws pi from its predictive distribution, with errors of geometry, shape (num_samples, 10)."""
        rho = self.densities.draw_samples(rng, num_samples)
        errors = rng.standard_normal((num_samples, len(self.geometry.Phi_errors)))
        return self.geometry.compute_parameters(rho, errors)
