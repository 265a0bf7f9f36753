"""Kinds of objects within a colour, as a learner with kinds remembers them.

A colour has one or more kinds, each with a mean density; the means of all kinds share one normal distribution in
information form. An object is identified by its appearance, and has one kind for each of its colours.

After a lift a kind without objects is removed. Two kinds of a colour are twins, and are merged, if their mean
densities more probably than not differ by less than ``deviation_sd``, the scatter of objects within a material.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

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


def teach(
    belief: DensityBelief,
    chosen: Sequence[int],
    likelihood: Likelihood,
    deviation_sd: float,
    earlier: Likelihood | None = None,
) -> DensityBelief:
    """Updates the mean densities of some of K kinds by a lift: Lambda += S^T P S, eta += S^T q.

    (P, q) is what the likelihood adds after the object's own deviation is marginalised. The cost is O(m^3 + K^3). The
    likelihood is of the object's m densities, whose kinds are chosen; earlier is the sum of those of its earlier
    lifts as one of these kinds, None if there was none.
    """
    return belief.condition(likelihood.marginalise_deviation(deviation_sd, earlier).embed(chosen, belief.size))


def assign(kinds: Kinds, known: KnownObject, place: int | None, chosen: Sequence[tuple[int, float]]) -> Kinds:
    """Assigns a lifted object, with its index or None if it is new, to a kind and its probability for each colour."""
    memberships = []
    for before, (kind, probability) in zip(known.memberships, chosen, strict=True):
        stays = place is not None and before.kind == kind
        memberships.append(Membership(kind, before.num_lifts + 1 if stays else 1, probability))
    lifted = known._replace(memberships=tuple(memberships))
    if place is None:
        return replace(kinds, objects=(*kinds.objects, lifted))
    return replace(kinds, objects=(*kinds.objects[:place], lifted, *kinds.objects[place + 1 :]))


def tidy(kinds: Kinds, prior: Prior) -> Kinds:
    """Removes kinds without objects, merges twins, and keeps own densities for odd objects only; O(K^3) in all."""
    counts = kinds.count_objects()
    # A colour that was seen and never lifted keeps its kind without objects.
    lifted = {colour for colour, count in zip(kinds.colours, counts, strict=True) if count}
    remains = [bool(count) or colour not in lifted for colour, count in zip(kinds.colours, counts, strict=True)]
    kinds = _renumber(kinds, np.flatnonzero(remains))
    while (twins := find_twins(kinds, prior.deviation_sd)) is not None:
        kinds = merge(kinds, *twins)
    return replace(kinds, objects=tuple(_forget_members(kinds, known) for known in kinds.objects))


def find_twins(kinds: Kinds, deviation_sd: float) -> tuple[int, int] | None:
    """Finds two kinds of a colour that are more probably than not within ``deviation_sd`` of each other, [kg/m^3]."""
    mean, covariance = kinds.belief.untruncated_mean, kinds.belief.covariance
    for one in range(len(kinds.colours)):
        for other in range(one + 1, len(kinds.colours)):
            if kinds.colours[one] == kinds.colours[other]:
                difference = mean[one] - mean[other]
                sd = np.sqrt(covariance[one, one] + covariance[other, other] - 2.0 * covariance[one, other])
                if ndtr((deviation_sd - difference) / sd) - ndtr((-deviation_sd - difference) / sd) > 0.5:
                    return one, other
    return None


def merge(kinds: Kinds, kept: int, merged: int) -> Kinds:
    """Merges two kinds into the older one; the belief is that of one kind with all their objects from the start."""
    # Both densities become one, rho = T rho'. That adds both priors, so that of the merged kind is subtracted.
    T = np.delete(np.eye(len(kinds.colours)), merged, axis=1)
    T[merged, kept] = 1.0
    precision = T.T @ kinds.belief.precision @ T
    information_vector = T.T @ kinds.belief.information_vector
    prior = kinds.priors[merged]
    precision[kept, kept] -= prior.sd**-2
    information_vector[kept] -= prior.mean / prior.sd**2
    objects = tuple(_rename(known, {merged: kept}) for known in kinds.objects)
    remaining = np.delete(np.arange(len(kinds.colours)), merged)
    return _select(replace(kinds, belief=DensityBelief(precision, information_vector), objects=objects), remaining)


def restrict_colours(kinds: Kinds, numbers: Mapping[int, int]) -> Kinds:
    """Returns the kinds of some colours, whose new numbers are given by old, and objects without other colours."""
    objects = tuple(known for known in kinds.objects if set(known.colours) <= numbers.keys())
    remaining = np.array([kind for kind, colour in enumerate(kinds.colours) if colour in numbers], dtype=np.intp)
    restricted = _renumber(replace(kinds, objects=objects), remaining)
    return replace(
        restricted,
        colours=tuple(numbers[colour] for colour in restricted.colours),
        objects=tuple(
            known._replace(colours=tuple(numbers[colour] for colour in known.colours)) for known in restricted.objects
        ),
    )


def _renumber(kinds: Kinds, remaining: NDArray[np.intp]) -> Kinds:
    """Returns the remaining kinds only; no object may be of another kind."""
    if len(remaining) == len(kinds.colours):
        return kinds
    return _select(replace(kinds, belief=kinds.belief.select(remaining.tolist())), remaining)


def _select(kinds: Kinds, remaining: NDArray[np.intp]) -> Kinds:
    """Selects the remaining kinds, to which the belief already refers, and renumbers them in all objects."""
    numbers = {int(old): new for new, old in enumerate(remaining)}
    return replace(
        kinds,
        colours=tuple(kinds.colours[kind] for kind in remaining),
        objects=tuple(_rename(known, numbers) for known in kinds.objects),
        priors=tuple(kinds.priors[kind] for kind in remaining),
    )


def _rename(known: KnownObject, numbers: dict[int, int]) -> KnownObject:
    """Renumbers the kinds of an object; kinds without a new number keep theirs."""
    memberships = tuple(
        membership._replace(kind=numbers.get(membership.kind, membership.kind)) for membership in known.memberships
    )
    return known._replace(memberships=memberships)


def _forget_members(kinds: Kinds, known: KnownObject) -> KnownObject:
    """Keeps own densities of an object only for colours in which it is outside the most populous kind."""
    odd = tuple(
        column
        for column in known.own.columns
        if known.memberships[column].kind != kinds.find_most_populous(known.colours[column])
    )
    return known._replace(own=known.own.restrict_to(odd))
