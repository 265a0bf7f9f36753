"""Memory of materials: beliefs about the densities of materials, by their colour.

A material is identified by its colour, not by its name: a brass-coloured object recalls the density of earlier
brass-coloured objects. A colour that was never seen before has the broad prior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from affordance.arguments import check_kind, check_number
from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities, find_colour_index
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief, FindLikelihood, Prior
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import FeltObject, Lesson, Memory, Recollection, tabulate_densities
from affordance.exceptions import BadArgumentError
from affordance.objects.appearance import Appearance, PartAppearance, is_same_object
from affordance.objects.colour import Colour, show_colour
from affordance.objects.materials import DENSITIES, Material, MaterialLike, find_colour

# Standard deviation of a known density, [kg/m^3].
_CERTAIN_SD = 1e-3


class HeldObject(NamedTuple):
    """Object that was held, whose deviation from its materials is the same each time."""

    appearance: Appearance  # with the colours of the memory
    columns: tuple[int, ...]  # indices of its m colours
    # Sum of the likelihoods of its own densities over all holds, of size m; None if it was never held.
    felt: Likelihood | None = None


@dataclass(frozen=True)
class MaterialMemory(Memory):
    """Beliefs about the mean density of each colour met so far.

    Attributes:
        colours: Known colours, in the order they were met.
        belief: Belief about the colours' mean densities, of size len(colours).
        objects: Objects that were held.
        at_hand: Object that was recalled last, until its hold is learned from.
    """

    colours: tuple[Colour, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF
    objects: tuple[HeldObject, ...] = ()
    at_hand: HeldObject | None = None

    def __post_init__(self) -> None:
        """Raises a BadArgumentError for a belief of another size than the colours."""
        check_kind("belief", self.belief, DensityBelief)
        if self.belief.size != len(self.colours):
            problem = f"is about {self.belief.size} densities, must be about {len(self.colours)}, one for each colour"
            raise BadArgumentError("belief", "", problem)

    def __repr__(self) -> str:
        return f"MaterialMemory({', '.join(map(show_colour, self.colours)) or 'no colour'}: {self.belief.describe()})"

    def _repr_html_(self) -> str:
        return tabulate_densities("Memory of materials", self)

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

    def recognise(
        self, colour: Colour, colour_sd: float, prior: Prior, lightness_sd: float = 0.0
    ) -> "tuple[MaterialMemory, int]":
        """Finds the material of a measured colour, or adds a material.

        A colour that may be of several materials becomes another material whose density has mean and covariances of
        their mixture: measurements of it then update each of them by its share. The normal distribution approximates
        the mixture (docs/decisions/0015-vision-from-pixels.md).

        Arguments and result are those of ``Memory``.
        """
        if colour_sd == 0.0:
            memory = self.add_colours([colour], prior)
            index = find_colour_index(memory.colours, colour)
            assert index is not None
            return memory, index
        probabilities = compute_colour_probabilities(colour, colour_sd, self.colours, lightness_sd)
        best = int(np.argmax(probabilities))
        if probabilities[best] >= CERTAIN and best < len(self.colours):
            return self, best
        belief = self.belief.extend_by_mixture(probabilities, prior)
        return replace(self, colours=(*self.colours, colour), belief=belief), len(self.colours)

    def recall(self, appearance: Sequence[PartAppearance], prior: Prior) -> "Recollection[MaterialMemory]":
        """Recalls the belief about objects of these colours, whether or not this one was held before; see ``Memory``.

        The cost is a comparison with every object, and O(M^3) for M colours.
        """
        memory, columns, parts = self, list[int](), list[PartAppearance]()
        for part in appearance:
            memory, column = memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
            columns.append(column)
            parts.append(part._replace(colour=memory.colours[column]))
        known = (held for held in memory.objects if is_same_object(held.appearance, parts))
        at_hand = next(known, HeldObject(tuple(parts), tuple(dict.fromkeys(columns))))
        densities = memory.belief.add_object_variation(prior.deviation_sd)
        colours = tuple(memory.colours[column] for column in at_hand.columns)
        felt = FeltObject.of(colours, at_hand.felt, prior, at_hand.appearance)
        return Recollection(replace(memory, at_hand=at_hand), densities, tuple(columns), felt)

    def learn(
        self, densities: DensityBelief, find_likelihood: FindLikelihood, deviation_sd: float
    ) -> "Lesson[MaterialMemory]":
        """Applies Bayes' rule to mean densities, with the object's own deviation marginalised; see ``Memory``.

        The deviation of an object that was held before is that of the earlier holds: likelihoods of all its holds
        are summed before it is marginalised, once. The cost is O(M^3) for M colours.
        """
        likelihood = find_likelihood(densities)
        earlier, objects = None, self.objects
        if self.at_hand is not None:
            appearance, columns, felt = self.at_hand
            own = likelihood.select(columns)
            if felt is not None:
                earlier, own = felt.embed(columns, self.belief.size), own.add(felt)
            others = (held for held in objects if held.appearance != appearance)
            objects = (*others, HeldObject(appearance, columns, own))
        materials = self.belief.condition(likelihood.marginalise_deviation(deviation_sd, earlier))
        memory = MaterialMemory(self.colours, materials, objects)
        return Lesson(memory, densities.condition(likelihood), likelihood)

    def restrict_to(self, colours: Sequence[Colour]) -> "MaterialMemory":
        """Returns the memory of these known colours only, and of objects that have no other colour."""
        if tuple(colours) == self.colours:
            return self
        kept = [self.colours.index(colour) for colour in colours]
        objects = tuple(
            held._replace(columns=tuple(kept.index(column) for column in held.columns))
            for held in self.objects
            if set(held.columns) <= set(kept)
        )
        return MaterialMemory(tuple(colours), self.belief.select(kept), objects)

    def add_colours(self, colours: Sequence[Colour], prior: Prior) -> "MaterialMemory":
        """Returns the memory with the prior added for each new colour."""
        memory = self
        for colour in colours:
            if find_colour_index(memory.colours, colour) is None:
                belief = memory.belief.extend(prior, 1)
                memory = replace(memory, colours=(*memory.colours, colour), belief=belief)
        return memory
