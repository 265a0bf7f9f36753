"""Kinds of things within a colour: what a learner remembers that can tell an odd member from a thing of its own.

A colour has one or more kinds, each a mean density; all kinds of all colours share one normal distribution in
information form. An object is known by its appearance, and is of one kind for each colour it shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.density_belief import DENSITY_FLOOR, EMPTY_BELIEF, DensityBelief, Prior
from affordance.objects.appearance import Appearance


class KindPrior(NamedTuple):
    """Normal distribution of the mean density of a kind before its first lift.

    Attributes:
        mean: Mean density, [kg/m^3].
        sd: Standard deviation, [kg/m^3].
    """

    mean: float
    sd: float


class Membership(NamedTuple):
    """Which kind an object is of, in one of its colours.

    Attributes:
        kind: Index of the kind.
        num_lifts: For how many of its last lifts it has been of this kind, n.
        probability: That it is, as judged at the last of them.
    """

    kind: int
    num_lifts: int
    probability: float


class OwnDensities(NamedTuple):
    """Densities of one object's own, for those of its colours in which it is outside the most populous kind.

    Attributes:
        columns: Which of the object's colours, m of them, increasing.
        belief: Belief about them, of size m.
    """

    columns: tuple[int, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF

    def restrict_to(self, columns: tuple[int, ...]) -> "OwnDensities":
        """Returns those of some of the columns."""
        if columns == self.columns:
            return self
        if not columns:
            return OwnDensities()
        indices = [self.columns.index(column) for column in columns]
        covariance = self.belief.covariance[np.ix_(indices, indices)]
        return OwnDensities(columns, DensityBelief.from_moments(self.belief.untruncated_mean[indices], covariance))


class KnownObject(NamedTuple):
    """An object that was lifted before.

    Attributes:
        appearance: What it looks like; its parts have the colours of the memory.
        colours: Indices of its colours, in the order of its columns.
        memberships: For each of these colours.
        own: Densities of its own.
    """

    appearance: Appearance
    colours: tuple[int, ...]
    memberships: tuple[Membership, ...]
    own: OwnDensities = OwnDensities()


@dataclass(frozen=True)
class Kinds:
    """The kinds there are, and the objects of each.

    Attributes:
        colours: Index of the colour of each of K kinds.
        belief: Belief about their mean densities, of size K.
        objects: The objects lifted so far.
        priors: Priors of the kinds, K of them.
    """

    colours: tuple[int, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF
    objects: tuple[KnownObject, ...] = ()
    priors: tuple[KindPrior, ...] = ()

    def list_of(self, colour: int) -> list[int]:
        """Indices of the kinds of a colour, the oldest first."""
        return [kind for kind, of in enumerate(self.colours) if of == colour]

    def count_objects(self, excluded: int | None = None) -> NDArray[np.intp]:
        """Counts the objects of each kind, shape (K,); one object, by its index, can be left out."""
        counts = np.zeros(len(self.colours), dtype=np.intp)
        for index, known in enumerate(self.objects):
            if index != excluded:
                counts[[membership.kind for membership in known.memberships]] += 1
        return counts

    def find_most_populous(self, colour: int) -> int:
        """Index of the kind of a colour that most objects are of; of equals the oldest."""
        candidates = self.list_of(colour)
        counts = self.count_objects()
        return max(candidates, key=lambda kind: (counts[kind], -kind))

    def find_reference(self, colour: int) -> float | None:
        """Mean density of a colour's most populous kind, [kg/m^3]; None of a colour of which nothing was lifted."""
        if not self.count_objects()[self.list_of(colour)].any():
            return None
        return max(float(self.belief.untruncated_mean[self.find_most_populous(colour)]), DENSITY_FLOOR)

    def predict_new(self, colour: int, prior: Prior, spread: float) -> KindPrior:
        """What is believed of a new kind of a colour.

        Args:
            colour: Index of the colour.
            prior: Prior of the first kind of a colour, which has nothing to be compared with.
            spread: Standard deviation of a further kind's density over the mean of the colour's most populous one.
        """
        reference = self.find_reference(colour)
        return KindPrior(prior.mode, prior.sd) if reference is None else KindPrior(reference, spread * reference)

    def add(self, colours: tuple[int, ...], priors: Sequence[KindPrior]) -> "Kinds":
        """Returns the kinds with new ones, each of a colour and with a prior; no object is of them yet."""
        return replace(
            self,
            colours=(*self.colours, *colours),
            belief=self.belief.extend_by([each.mean for each in priors], [each.sd for each in priors]),
            priors=(*self.priors, *priors),
        )

    def compute_category_sd(self, kappa: float) -> Array:
        """Breadth of each kind as a category: kappa times its mean density, shape (K,), [kg/m^3]."""
        breadth: Array = kappa * np.maximum(self.belief.untruncated_mean, DENSITY_FLOOR)
        return breadth


NO_KINDS = Kinds()
