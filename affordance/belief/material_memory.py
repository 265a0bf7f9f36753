"""Memory of materials: beliefs about the densities of materials, by their colour.

A material is known by its colour, not by its name: whoever sees a brass-coloured object recalls what brass-coloured
objects weighed. A colour never seen before gets the broad prior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from affordance.arguments import check_kind, check_number
from affordance.belief.colour_recognition import compute_colour_probabilities
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief, Prior
from affordance.belief.known_density import Density, describe_density, tabulate_densities
from affordance.belief.object_belief import FindLikelihood, Lesson, Recollection
from affordance.exceptions import BadArgumentError
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour, is_same_colour, show_colour
from affordance.objects.named_colour import MaterialLike, find_colour
from affordance.objects.tool import DENSITIES, Material

# What is more probable than this is taken for certain; the rest of the probability is let go.
CERTAIN = 0.95
# Standard deviation of what is known for certain, [kg/m^3].
_CERTAIN_SD = 1e-3


@dataclass(frozen=True)
class MaterialMemory:
    """Beliefs about the mean density of each colour met so far.

    Attributes:
        colours: The colours, in the order they were met.
        belief: Belief about their mean densities, of size len(colours).
    """

    colours: tuple[Colour, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF

    def __post_init__(self) -> None:
        """Checks that there is one density for each colour.

        Raises:
            BadArgumentError: There is not.
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
        """The memory of one who knows materials as well as can be.

        Args:
            densities: Densities by name of the material, material or colour, [kg/m^3].
            materials: Materials by name; those that come with the program if None.

        Raises:
            BadArgumentError: There is no such material, it is no colour either, or a density is not positive.
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
        """What is believed of a material that was met: mean, standard deviation and percentiles, [kg/m^3].

        Args:
            material: Name of a material, a material, or a colour.
            materials: Materials by name; those that come with the program if None.

        Raises:
            BadArgumentError: There is no such material, or nothing of its colour was met.
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
        """Finds which material a measured colour is of, or makes it a material of its own.

        A colour that may be of several materials becomes one whose density has mean and covariances of the mixture
        of theirs: what is felt of it then teaches about each of them by its share. That normal distribution stands
        for the mixture is an approximation (docs/decisions/0015-vision-from-pixels.md).

        Args:
            colour: The colour as measured.
            colour_sd: Standard deviation of the measurement in each direction of CIELAB; 0 if it is exact.
            prior: What is believed of materials never met.
            lightness_sd: Standard deviation of a further error of its brightness, in units of L*.

        Returns: The memory, which has met the colour, and the index of its material.
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
        """Recalls what objects of these colours weighed; see ``Memory``. Costs O(M^3) for M colours."""
        memory, columns = self, []
        for part in appearance:
            memory, column = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            columns.append(column)
        return Recollection(memory, memory.belief.add_object_variation(prior.deviation_sd), tuple(columns))

    def learn(
        self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float
    ) -> "Lesson[MaterialMemory]":
        """Applies Bayes' rule to mean densities, the object's own deviation marginalised; see ``Memory``.

        Costs O(M^3) for M colours.
        """
        likelihood = find_likelihood(densities)
        materials = self.belief.condition(likelihood.marginalise_deviation(deviation_sd))
        return Lesson(MaterialMemory(self.colours, materials), densities.condition(likelihood), likelihood)

    def restrict_to(self, colours: Sequence[Colour]) -> "MaterialMemory":
        """Returns the memory with these colours only, all of which it has met, in their order."""
        if tuple(colours) == self.colours:
            return self
        indices = [self.colours.index(look) for look in colours]
        covariance = self.belief.covariance[np.ix_(indices, indices)]
        return MaterialMemory(
            tuple(colours), DensityBelief.from_moments(self.belief.untruncated_mean[indices], covariance)
        )

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> "MaterialMemory":
        """Returns the memory extended by the prior for those colours that were never met."""
        memory = self
        for colour in colours:
            if memory.find(colour) is None:
                memory = MaterialMemory((*memory.colours, colour), memory.belief.extend(prior, 1))
        return memory
