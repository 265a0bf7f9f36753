"""Memory of materials: beliefs about the densities of materials, by their colour.

A material is identified by its colour, not by its name: a brass-coloured object recalls the density of earlier
brass-coloured objects. A colour that was never seen before has the broad prior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from affordance.arguments import check_kind, check_number
from affordance.belief.colour_recognition import compute_colour_probabilities
from affordance.belief.density_belief import EMPTY_BELIEF, Density, DensityBelief, FindLikelihood, Prior
from affordance.belief.known_density import describe_density, tabulate_densities
from affordance.belief.object_belief import Lesson, Recollection
from affordance.exceptions import BadArgumentError
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.objects.inertia import DENSITIES
from affordance.objects.material import Material, MaterialLike
from affordance.objects.materials import find_colour

# Probability above which a colour is taken as certain, and the others are ignored.
CERTAIN = 0.95
# Standard deviation of a known density, [kg/m^3].
_CERTAIN_SD = 1e-3


@dataclass(frozen=True)
class MaterialMemory:
    """Beliefs about the mean density of each colour met so far.

    Attributes:
        colours: Known colours, in the order they were met.
        belief: Belief about the colours' mean densities, of size len(colours).
    """

    colours: tuple[Colour, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF

    def __post_init__(self) -> None:
        """Checks that there is one density for each colour.

        Raises:
            BadArgumentError: The belief has another size than the colours.
        """
        check_kind("belief", self.belief, DensityBelief)
        if self.belief.size != len(self.colours):
            problem = f"is about {self.belief.size} densities, must be about {len(self.colours)}, one for each colour"
            raise BadArgumentError("belief", "", problem)

    def __repr__(self) -> str:
        return f"MaterialMemory({', '.join(map(show_colour, self.colours)) or 'no colour'}: {self.belief.describe()})"

    def _repr_html_(self) -> str:
        return tabulate_densities("Memory of materials", self.colours, self.belief)

    @classmethod
    def from_densities[M: MaterialLike](
        cls, densities: Mapping[M, float], materials: Mapping[str, Material] | None = None
    ) -> "MaterialMemory":
        """Builds the memory of an observer that knows materials exactly.

        Args:
            densities: Densities by name of the material, material or colour, [kg/m^3].
            materials: Materials by name; None for those of the package.

        Raises:
            BadArgumentError: A key is neither a material nor a colour, or a density is out of bounds.
        """
        if not isinstance(densities, Mapping):
            problem = f"is of type {type(densities).__name__}, must be a mapping from materials or colours to kg/m^3"
            raise BadArgumentError("densities", "", problem)
        colours = tuple(find_colour(material, materials, "densities") for material in densities)
        known = np.array(
            [
                check_number(f"densities[{material!r}]", value, DENSITIES.low, DENSITIES.high, "kg/m^3")
                for material, value in densities.items()
            ],
            dtype=float,
        )
        return cls(colours, DensityBelief.from_moments(known, _CERTAIN_SD**2 * np.eye(len(known))))

    def density(self, material: MaterialLike, materials: Mapping[str, Material] | None = None) -> Density:
        """Returns the belief about a material that was met: mean, standard deviation and percentiles, [kg/m^3].

        Args:
            material: Name of a material, a material, or a colour.
            materials: Materials by name; None for those of the package.

        Raises:
            BadArgumentError: The material does not exist, or no object of its colour was met.
        """
        return describe_density(self.colours, self.belief, material, materials)

    def find(self, colour: Colour) -> int | None:
        """Returns the index of a colour, or None if it was never met."""
        for index, look in enumerate(self.colours):
            if is_same_colour(look, colour):
                return index
        return None

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> "tuple[MaterialMemory, int]":
        """Finds the material of a measured colour, or adds a material.

        A colour that may be of several materials becomes another material whose density has mean and covariances of
        their mixture: measurements of it then update each of them by its share. The normal distribution approximates
        the mixture (docs/decisions/0015-vision-from-pixels.md).

        Args:
            colour: Measured colour, red, green and blue in [0, 1].
            colour_sd: Standard deviation of the measurement in each direction of CIELAB; 0 if it is exact.
            prior: Prior of materials that were never met.
            lightness_sd: Standard deviation of an additional error of its brightness, in units of L*.

        Returns: The memory with the colour, and the index of its material.
        """
        if colour_sd == 0.0:
            memory = self.add_colours([colour], prior)
            index = memory.find(colour)
            assert index is not None
            return memory, index
        probabilities = compute_colour_probabilities(colour, colour_sd, self.colours, lightness_sd)
        best = int(np.argmax(probabilities))
        if probabilities[best] >= CERTAIN and best < len(self.colours):
            return self, best
        return MaterialMemory((*self.colours, colour), self.belief.extend_by_mixture(probabilities, prior)), len(
            self.colours
        )

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> "Recollection[MaterialMemory]":
        """Recalls the belief about objects of these colours, at a cost of O(M^3) for M colours; see ``Memory``."""
        memory, columns = self, []
        for part in appearance:
            memory, column = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            columns.append(column)
        return Recollection(memory, memory.belief.add_object_variation(prior.deviation_sd), tuple(columns))

    def learn(
        self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float
    ) -> "Lesson[MaterialMemory]":
        """Applies Bayes' rule to mean densities, with the object's own deviation marginalised; see ``Memory``.

        The cost is O(M^3) for M colours.
        """
        likelihood = find_likelihood(densities)
        materials = self.belief.condition(likelihood.marginalise_deviation(deviation_sd))
        return Lesson(MaterialMemory(self.colours, materials), densities.condition(likelihood), likelihood)

    def restrict_to(self, colours: Sequence[Colour]) -> "MaterialMemory":
        """Returns the memory of these known colours only, in their order."""
        if tuple(colours) == self.colours:
            return self
        return MaterialMemory(tuple(colours), self.belief.select([self.colours.index(colour) for colour in colours]))

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> "MaterialMemory":
        """Returns the memory with the prior added for each new colour."""
        memory = self
        for colour in colours:
            if memory.find(colour) is None:
                memory = MaterialMemory((*memory.colours, colour), memory.belief.extend(prior, 1))
        return memory
