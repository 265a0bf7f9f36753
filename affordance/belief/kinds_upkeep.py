"""What changes among kinds when a lift was judged: whose kind an object is of, and which kinds there are.

A kind that all objects have left is forgotten. Two kinds of a colour are twins, and become one, when it is more
probable than not that their mean densities differ by less than objects of one material do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.kinds import Kinds, KnownObject, Membership
from affordance.belief.likelihood import Likelihood


def teach(belief: DensityBelief, chosen: Sequence[int], likelihood: Likelihood, deviation_sd: float) -> DensityBelief:
    """Adds what a lift says of the mean densities of some of K kinds: Lambda += S^T P S, eta += S^T q.

    (P, q) is the likelihood after the object's own deviation is marginalised. Costs O(m^3 + K^3).

    Args:
        belief: About all kinds, of size K.
        chosen: The kind of each of the object's m colours.
        likelihood: Of the object's densities, of size m.
        deviation_sd: Standard deviation of an object's density about its kind's mean, [kg/m^3].
    """
    marginal = likelihood.marginalise_deviation(deviation_sd)
    S = np.zeros((len(chosen), belief.size))
    S[np.arange(len(chosen)), list(chosen)] = 1.0
    return belief.condition(
        Likelihood(S.T @ marginal.precision @ S, S.T @ marginal.information_vector, marginal.log_constant)
    )


def assign(kinds: Kinds, known: KnownObject, place: int | None, chosen: Sequence[tuple[int, float]]) -> Kinds:
    """Makes an object, which was lifted, a member of the kinds that were chosen for it.

    Args:
        kinds: The kinds and their objects.
        known: The object, with what is believed of its own densities after the lift.
        place: Its place among the objects; None if it was never lifted before.
        chosen: For each of its colours the kind, and with what probability it is of this kind.
    """
    memberships = []
    for before, (kind, probability) in zip(known.memberships, chosen, strict=True):
        stays = place is not None and before.kind == kind
        memberships.append(Membership(kind, before.num_lifts + 1 if stays else 1, probability))
    lifted = known._replace(memberships=tuple(memberships))
    if place is None:
        return replace(kinds, objects=(*kinds.objects, lifted))
    return replace(kinds, objects=(*kinds.objects[:place], lifted, *kinds.objects[place + 1 :]))


def tidy(kinds: Kinds, prior: Prior) -> Kinds:
    """Forgets kinds without objects, makes twins one, and leaves densities of their own to odd objects only.

    Costs O(K^3) for K kinds, and O(K^2) comparisons.
    """
    counts = kinds.count_objects()
    # A colour that was met and never lifted has a kind without objects, and keeps it.
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
    """Makes one kind of two: what is believed is what it would be, had all their objects been of it from the start.

    Args:
        kinds: The kinds.
        kept: The older of the two; it takes the other's objects, and has started with its own prior.
        merged: The other.
    """
    # Both densities are one: rho = T rho'. Both priors come in, so that of the merged kind is taken out again.
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
    """Returns the kinds of some of the colours, and the objects that show no other.

    Args:
        kinds: The kinds.
        numbers: New index of each colour that remains, by its old one.
    """
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
    """Returns some of the kinds only, none of which an object has left."""
    if len(remaining) == len(kinds.colours):
        return kinds
    covariance = kinds.belief.covariance[np.ix_(remaining, remaining)]
    belief = DensityBelief.from_moments(kinds.belief.untruncated_mean[remaining], covariance)
    return _select(replace(kinds, belief=belief), remaining)


def _select(kinds: Kinds, remaining: NDArray[np.intp]) -> Kinds:
    """Leaves some of the kinds, which the belief is of already, and gives them new numbers in all objects."""
    numbers = {int(old): new for new, old in enumerate(remaining)}
    return replace(
        kinds,
        colours=tuple(kinds.colours[kind] for kind in remaining),
        objects=tuple(_rename(known, numbers) for known in kinds.objects),
        priors=tuple(kinds.priors[kind] for kind in remaining),
    )


def _rename(known: KnownObject, numbers: dict[int, int]) -> KnownObject:
    """Gives the kinds of an object other numbers; those not named keep theirs."""
    memberships = tuple(
        membership._replace(kind=numbers.get(membership.kind, membership.kind)) for membership in known.memberships
    )
    return known._replace(memberships=memberships)


def _forget_members(kinds: Kinds, known: KnownObject) -> KnownObject:
    """Leaves densities of its own to an object only where it is outside its colour's most populous kind."""
    odd = tuple(
        column
        for column in known.own.columns
        if known.memberships[column].kind != kinds.find_most_populous(known.colours[column])
    )
    return known._replace(own=known.own.restrict_to(odd))
