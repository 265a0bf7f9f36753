"""Kinds of objects within a colour, as a learner with kinds remembers them.

A colour has one or more kinds, each with a mean density; the means of all kinds share one normal distribution in
information form. An object is identified by its appearance, and has one kind for each of its colours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.density_belief import DENSITY_FLOOR, EMPTY_BELIEF, DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.appearance import Appearance


class KindPrior(NamedTuple):
    """Normal distribution of the mean density of a kind before its first lift: mean and SD, [kg/m^3]."""

    mean: float
    sd: float


class Membership(NamedTuple):
    """Membership of an object in a kind, for one of its colours."""

    kind: int  # index of the kind
    num_lifts: int  # number n of consecutive last lifts in which the object was of this kind
    probability: float  # probability of this kind after the last of these lifts


class OwnDensities(NamedTuple):
    """Belief about own densities of an object, for its columns outside the most populous kind, increasing."""

    columns: tuple[int, ...] = ()
    belief: DensityBelief = EMPTY_BELIEF

    def restrict_to(self, columns: tuple[int, ...]) -> "OwnDensities":
        """Returns the densities of some of the columns."""
        return OwnDensities(columns, self.belief.select([self.columns.index(column) for column in columns]))


class KnownObject(NamedTuple):
    """Object that was lifted before."""

    appearance: Appearance  # with the colours of the memory
    colours: tuple[int, ...]  # indices of its colours, in the order of its columns
    memberships: tuple[Membership, ...]  # one for each of these colours
    own: OwnDensities = OwnDensities()
    # Sum of the likelihoods of its own densities, over the lifts since it has been of these kinds; None if it was
    # never lifted.
    felt: Likelihood | None = None


@dataclass(frozen=True)
class Kinds:
    """Kinds and their objects."""

    colours: tuple[int, ...] = ()  # index of the colour of each of K kinds
    belief: DensityBelief = EMPTY_BELIEF  # about the kinds' mean densities, of size K
    objects: tuple[KnownObject, ...] = ()  # those that were lifted
    priors: tuple[KindPrior, ...] = ()  # one for each of K kinds

    def list_of(self, colour: int) -> list[int]:
        """Lists the indices of the kinds of a colour, the oldest first."""
        return [kind for kind, of in enumerate(self.colours) if of == colour]

    def count_objects(self, excluded: int | None = None) -> NDArray[np.intp]:
        """Counts the objects of each kind, shape (K,); the object of an index can be excluded."""
        counts = np.zeros(len(self.colours), dtype=np.intp)
        for index, known in enumerate(self.objects):
            if index != excluded:
                counts[[membership.kind for membership in known.memberships]] += 1
        return counts

    def find_most_populous(self, colour: int) -> int:
        """Finds the index of the kind of a colour with the most objects; the oldest among equals."""
        candidates = self.list_of(colour)
        counts = self.count_objects()
        return max(candidates, key=lambda kind: (counts[kind], -kind))

    def find_reference(self, colour: int) -> float | None:
        """Finds the scale of the densities of a colour's further kinds, [kg/m^3]; None if no such object was lifted.

        It is the root mean square of the mean density of the most populous kind, which equals the mean if that is
        well known. The mean alone gives no scale for a kind that was hardly felt: errors may bring it near zero.
        """
        if not self.count_objects()[self.list_of(colour)].any():
            return None
        kind = self.find_most_populous(colour)
        return float(np.sqrt(self.belief.untruncated_mean[kind] ** 2 + self.belief.covariance[kind, kind]))

    def predict_new(self, colour: int, prior: Prior, spread: float) -> KindPrior:
        """Predicts the density of a new kind of a colour, for which the prior holds if it is the first one.

        The spread is the ratio of the SD of a further kind's density to the scale of the most populous kind's.
        """
        reference = self.find_reference(colour)
        return KindPrior(prior.mode, prior.sd) if reference is None else KindPrior(reference, spread * reference)

    def add(self, colours: tuple[int, ...], priors: Sequence[KindPrior]) -> "Kinds":
        """Returns the kinds with new ones, each with a colour and a prior, and without objects."""
        return replace(
            self,
            colours=(*self.colours, *colours),
            belief=self.belief.extend_by([each.mean for each in priors], [each.sd for each in priors]),
            priors=(*self.priors, *priors),
        )

    def compute_category_sd(self, kappa: float) -> Array:
        """Computes the breadth of each kind as a category, kappa times its mean density, shape (K,), [kg/m^3]."""
        breadth: Array = kappa * np.maximum(self.belief.untruncated_mean, DENSITY_FLOOR)
        return breadth


NO_KINDS = Kinds()
