"""Summary of the memory of a learner with kinds, for reading and drawing: kinds, objects and probabilities."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.belief.kind_memory import KindMemory
from affordance.belief.kinds import KnownObject
from affordance.belief.object_belief import Memory
from affordance.objects.appearance import Appearance, PartAppearance
from affordance.objects.colour import Colour, is_same_colour


class ObjectSummary(NamedTuple):
    """Summary of an object in one of its colours.

    Attributes:
        appearance: Appearance of the object.
        probability: Probability of its kind after its last lift.
        num_lifts: Number of consecutive last lifts in which it was of this kind.
        density: Mean of the belief about its density, [kg/m^3].
        sd: Standard deviation of the belief about its density, [kg/m^3].
        has_own: True if it has a density of its own, False if it has that of its kind.
    """

    appearance: Appearance
    probability: float
    num_lifts: int
    density: float
    sd: float
    has_own: bool


class KindSummary(NamedTuple):
    """Summary of a kind.

    Attributes:
        colour: Red, green and blue in [0, 1].
        density: Mean of the belief about its mean density, [kg/m^3].
        sd: Standard deviation of the belief about its mean density, [kg/m^3].
        is_most_populous: True if new objects of this colour are believed to be of this kind.
        objects: Objects of the kind.
    """

    colour: Colour
    density: float
    sd: float
    is_most_populous: bool
    objects: tuple[ObjectSummary, ...]


def count_kinds(memory: Memory) -> int:
    """Counts the kinds that have objects; zero for a learner without kinds."""
    return int((memory.kinds.count_objects() > 0).sum()) if isinstance(memory, KindMemory) else 0


def find_kind(memory: Memory, appearance: Sequence[PartAppearance]) -> int:
    """Finds the number of an object's kind in the colour of its first part, 1 for the oldest; 0 if unknown."""
    if not isinstance(memory, KindMemory):
        return 0
    place = memory.find(appearance)
    if place is None:
        return 0
    known = memory.kinds.objects[place]
    for colour, membership in zip(known.colours, known.memberships, strict=True):
        if is_same_colour(memory.colours[colour], appearance[0].colour):
            return 1 + memory.kinds.list_of(colour).index(membership.kind)
    return 0


def summarise_kinds(memory: KindMemory) -> tuple[KindSummary, ...]:
    """Lists the kinds, colour by colour, each with its objects."""
    kinds, belief = memory.kinds, memory.kinds.belief
    summaries = []
    for index, colour in enumerate(memory.colours):
        for kind in kinds.list_of(index):
            density, sd = float(belief.untruncated_mean[kind]), float(np.sqrt(belief.covariance[kind, kind]))
            objects = [
                _summarise_object(known, column, density, sd)
                for known in kinds.objects
                for column, membership in enumerate(known.memberships)
                if membership.kind == kind
            ]
            is_most_populous = kind == kinds.find_most_populous(index)
            summaries.append(KindSummary(colour, density, sd, is_most_populous, tuple(objects)))
    return tuple(summaries)


def _summarise_object(known: KnownObject, column: int, density: float, sd: float) -> ObjectSummary:
    has_own = column in known.own.columns
    if has_own:
        place = known.own.columns.index(column)
        density = float(known.own.belief.untruncated_mean[place])
        sd = float(np.sqrt(known.own.belief.covariance[place, place]))
    membership = known.memberships[column]
    return ObjectSummary(known.appearance, membership.probability, membership.num_lifts, density, sd, has_own)
