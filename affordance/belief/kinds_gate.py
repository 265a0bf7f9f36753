"""The gate: is an object that was just lifted an odd member of its kind, of another kind, or a thing of its own?

Before a lift the kind of an object is distributed as in a Chinese restaurant whose guests are objects, sticky for
each of them. With N_k other objects of kind k, N their sum, n the lifts for which it has been of its present kind z:

    g_k = N_k / (N + alpha),   g_new = alpha / (N + alpha)
    p(z) = (n + c g_z) / (n + c),   p(k) = c g_k / (n + c),   p(new) = c g_new / (n + c)

A hypothesis h gives each colour of the object a kind. Under h the object's densities are S_h rho + delta, with S_h
what selects these kinds among all and delta ~ N(0, diag(kappa rho_hat)^2), rho_hat the kinds' means before the lift:
what is felt has an evidence in closed form, and p(h) is proportional to prior times evidence. Only this lift counts:
evidence that a member is odd is not added up over lifts, or in the end everything would be a thing of its own.

A new kind of a colour of which something was lifted has a density N(ref, (s ref)^2), ref the mean of the colour's
most populous kind: no density is a scale of its own, and the same experiment with all densities multiplied has the
same odds. Its breadth is kappa times the density that the hypothesis, after the lift, leads to believe, as the size
of errors is; before the lift nothing is known of it. The first kind of a colour has the prior of all materials.

kappa is the breadth of a category, and decides here alone; how much a lift teaches of a kind's mean is decided by the
scatter of objects within a material (``Prior.deviation_sd``). They are two numbers, not one generative model.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.kinds import Kinds, KnownObject, OwnDensities
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import FindLikelihood

# Change of a density, over that of the reference, at which the breadth of a new kind is settled, and most passes.
_SETTLED, _MAX_PASSES = 1e-5, 50


class GateSettings(NamedTuple):
    """What the gate goes by.

    Attributes:
        kappa: Breadth of a category over its mean density.
        concentration: alpha, how readily a new kind is founded, in objects.
        switching: c, how readily an object changes its kind, in lifts.
        spread: s, standard deviation of the density of a further kind of a colour over the mean of the most populous.
    """

    kappa: float
    # One of each is Laplace's rule of succession: as if one more object, or lift, had been seen that is of any kind.
    concentration: float = 1.0
    switching: float = 1.0
    # s; from 1 to 3 it hardly decides what is learned (docs/decisions/0026-kinds.md).
    spread: float = 2.0


class Hypothesis(NamedTuple):
    """One answer to which kinds an object of m colours is of.

    Attributes:
        kinds: Of each colour.
        probability: Before the lift.
        densities: What it says of the object's densities, of size m.
        founded: Columns of which the kind is new and not the first of its colour.
    """

    kinds: tuple[int, ...]
    probability: float
    densities: DensityBelief
    founded: tuple[int, ...] = ()


class Verdict(NamedTuple):
    """What a lift says about a hypothesis.

    Attributes:
        hypothesis: The hypothesis; new kinds have the breadth that it leads to believe after the lift.
        probability: After the lift.
        log_evidence: Log probability density of what was felt under it.
        likelihood: Of the object's densities; errors have the size that this hypothesis leads to believe.
        posterior: Belief about the object's densities after the lift, if it is true.
    """

    hypothesis: Hypothesis
    probability: float
    log_evidence: float
    likelihood: Likelihood
    posterior: DensityBelief


def compute_kind_probabilities(
    counts: NDArray[np.intp], settings: GateSettings, *, current: int | None = None, num_lifts: int = 0
) -> Array:
    """Probabilities that an object is of each kind of a colour, and, last, of a new one, before it is lifted.

    Args:
        counts: How many other objects are of each of K kinds, shape (K,).
        settings: What the gate goes by.
        current: Which of the K kinds it is of; None if it was never lifted.
        num_lifts: For how many of its last lifts it has been of that kind, n.

    Returns: Probabilities, shape (K + 1,), which sum to one.
    """
    shares = np.append(counts, settings.concentration) / (counts.sum() + settings.concentration)
    weights: Array = settings.switching * shares
    if current is None:
        return weights / settings.switching
    weights[current] += num_lifts
    return weights / (num_lifts + settings.switching)


def list_hypotheses(kinds: Kinds, known: KnownObject, place: int | None, settings: GateSettings) -> list[Hypothesis]:
    """Lists all hypotheses about an object: as many as the product of K_i + 1 over its colours, with K_i kinds each.

    Args:
        kinds: The kinds and their objects, and at the end for each of the object's colours a kind that is new.
        known: The object; if it was never lifted, its memberships say nothing.
        place: Its place among the objects; None if it was never lifted.
        settings: What the gate goes by.

    Returns: Those with a probability above zero.
    """
    counts = kinds.count_objects(excluded=place)
    first_new = len(kinds.colours) - len(known.colours)
    columns: list[list[tuple[int, float]]] = []
    for column, colour in enumerate(known.colours):
        *there, new = kinds.list_of(colour)
        assert new == first_new + column
        membership = known.memberships[column]
        probabilities = (
            compute_kind_probabilities(counts[there], settings)
            if place is None
            else compute_kind_probabilities(
                counts[there], settings, current=there.index(membership.kind), num_lifts=membership.num_lifts
            )
        )
        pairs = zip([*there, new], probabilities.tolist(), strict=True)
        columns.append([(kind, probability) for kind, probability in pairs if probability > 0.0])
    breadth = kinds.compute_category_sd(settings.kappa)
    has_reference = [kinds.find_reference(colour) is not None for colour in known.colours]
    hypotheses = []
    for chosen in itertools.product(*columns):
        chosen_kinds = tuple(kind for kind, _ in chosen)
        probability = float(np.prod([probability for _, probability in chosen]))
        densities = predict_densities(kinds, chosen_kinds, breadth, find_stable(known, chosen_kinds))
        founded = tuple(
            column for column, kind in enumerate(chosen_kinds) if kind >= first_new and has_reference[column]
        )
        hypotheses.append(Hypothesis(chosen_kinds, probability, densities, founded))
    return hypotheses


def find_stable(known: KnownObject, chosen: Sequence[int]) -> OwnDensities:
    """Densities of an object's own that a hypothesis leaves alone: where the object stays of the kind it is of."""
    stays = [column for column in known.own.columns if known.memberships[column].kind == chosen[column]]
    return known.own.restrict_to(tuple(stays))


def predict_densities(kinds: Kinds, chosen: Sequence[int], scatter_sd: Array, own: OwnDensities) -> DensityBelief:
    """Belief about the densities of an object of given kinds, S rho + delta, or its own where it has its own.

    Args:
        kinds: The K kinds.
        chosen: The kind of each of the object's m colours.
        scatter_sd: Standard deviation of delta for each kind, shape (K,), [kg/m^3].
        own: Densities of its own.

    Returns: Belief of size m.
    """
    indices = np.array(chosen)
    mean = kinds.belief.untruncated_mean[indices]
    covariance = kinds.belief.covariance[np.ix_(indices, indices)] + np.diag(scatter_sd[indices] ** 2)
    if own.columns:
        columns = list(own.columns)
        mean[columns] = own.belief.untruncated_mean
        covariance[columns, :] = covariance[:, columns] = 0.0
        covariance[np.ix_(columns, columns)] = own.belief.covariance
    return DensityBelief.from_moments(mean, covariance)


def weigh(hypotheses: Sequence[Hypothesis], find_likelihood: FindLikelihood, settings: GateSettings) -> list[Verdict]:
    """Weighs hypotheses by what was felt.

    Evidence is that of normal distributions; that densities are positive is left out here, as it is where a trial's
    surprise is judged. Costs a search for the likelihood and O(m^3) for each hypothesis about m colours, and some
    more searches for each that founds a kind.

    Args:
        hypotheses: The hypotheses.
        find_likelihood: Finds the likelihood of what was felt.
        settings: Settings of the gate.
    """
    judged = [settle_breadth(hypothesis, find_likelihood, settings.kappa) for hypothesis in hypotheses]
    log_evidences = [
        belief.compute_untruncated_log_evidence(likelihood, posterior) for belief, likelihood, posterior in judged
    ]
    log_weights = np.log([hypothesis.probability for hypothesis in hypotheses]) + log_evidences
    weights = np.exp(log_weights - log_weights.max())
    return [
        Verdict(hypothesis._replace(densities=belief), probability, log_evidence, likelihood, posterior)
        for hypothesis, probability, log_evidence, (belief, likelihood, posterior) in zip(
            hypotheses, (weights / weights.sum()).tolist(), log_evidences, judged, strict=True
        )
    ]


def settle_breadth(
    hypothesis: Hypothesis, find_likelihood: FindLikelihood, kappa: float
) -> tuple[DensityBelief, Likelihood, DensityBelief]:
    """Gives new kinds the breadth that a hypothesis leads to believe after the lift.

    Each pass takes the density from the one before, the first that before the lift. Where it is heavier than the
    reference the passes rise towards what is felt, which they do not exceed; where it is lighter they end within a
    few, as the breadth is a small part of the spread.

    Args:
        hypothesis: The hypothesis; one that founds no further kind takes one pass.
        find_likelihood: Finds the likelihood of what was felt.
        kappa: Breadth of a category over its mean density.

    Returns: Belief about the object's densities before the lift; likelihood; belief after it.
    """
    columns = list(hypothesis.founded)
    belief = hypothesis.densities
    rho = belief.untruncated_mean[columns]
    for _ in range(_MAX_PASSES):
        likelihood = find_likelihood(belief)
        posterior = belief.condition(likelihood)
        previous, rho = rho, np.maximum(posterior.untruncated_mean[columns], 0.0)
        if np.all(np.abs(rho - previous) <= _SETTLED * belief.untruncated_mean[columns]):
            break
        belief = _change_variances(belief, columns, kappa**2 * (rho**2 - previous**2))
    return belief, likelihood, posterior


def start_kinds(verdict: Verdict, find_likelihood: FindLikelihood, spread: float) -> Verdict:
    """The verdict with further kinds as broad as things of their own: s times the larger of reference and lift.

    What was taken for true needs no gate any more: with a spread of twice the reference alone, a thing many times as
    heavy would be believed lighter than it was felt, lift after lift.

    Args:
        verdict: About the hypothesis that is taken for true.
        find_likelihood: Finds the likelihood of what was felt.
        spread: s.
    """
    columns = list(verdict.hypothesis.founded)
    if not columns:
        return verdict
    belief = verdict.hypothesis.densities
    largest = np.maximum(belief.untruncated_mean, verdict.posterior.untruncated_mean)[columns]
    belief = _change_variances(belief, columns, (spread * largest) ** 2 - np.diag(belief.covariance)[columns])
    likelihood = find_likelihood(belief)
    hypothesis = verdict.hypothesis._replace(densities=belief)
    return verdict._replace(hypothesis=hypothesis, likelihood=likelihood, posterior=belief.condition(likelihood))


def _change_variances(belief: DensityBelief, columns: Sequence[int], changes: Array) -> DensityBelief:
    """The belief with some variances changed; these densities are independent of the others."""
    covariance = np.array(belief.covariance)
    covariance[columns, columns] += changes
    return DensityBelief.from_moments(belief.untruncated_mean, covariance)
