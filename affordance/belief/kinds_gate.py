"""Decides after a lift whether an object is odd, of another known kind, or of a new kind.

Before a lift the kind of an object follows a sticky Chinese restaurant process whose guests are objects. Let N_k be
the number of other objects of kind k, N their sum, and n the number of lifts in which the object was of its present
kind z. Then

    g_k = N_k / (N + alpha),   g_new = alpha / (N + alpha)
    p(z) = (n + c g_z) / (n + c),   p(k) = c g_k / (n + c),   p(new) = c g_new / (n + c)

A hypothesis h assigns a kind to each colour of the object. Under h the object's densities are S_h rho + delta, where
S_h selects these kinds, delta ~ N(0, diag(kappa rho_hat)^2), and rho_hat are the kinds' means before the lift. The
evidence of the measured torques is computed by Laplace's method, and p(h) is proportional to prior times evidence.
Only the present lift counts: if evidence of oddness were accumulated over lifts, every object would end up as a kind
of its own.

A further kind of a colour has a density N(ref, (s ref)^2), where ref = sqrt(mean^2 + variance) is the root mean
square density of the colour's most populous kind. There is no absolute scale, so the odds do not change if all
densities are scaled. Since the density of a new kind is unknown before the lift, its breadth is kappa times its
posterior density under the hypothesis. The first kind of a colour has the prior of all materials. Once adopted, a new
kind starts with an SD of s times its density; the first kind's SD is at least the prior's.

kappa, the breadth of a category, acts only here. How far a lift moves a kind's mean depends on the scatter of objects
within a material (``Prior.deviation``). The two parameters do not belong to one generative model.
"""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, Mask
from affordance.belief.density_belief import DENSITY_FLOOR
from affordance.belief.holds import Felt, add_hold
from affordance.belief.kinds import (
    KindPrior,
    add_kinds,
    believe_kinds,
    count_things,
    find_most_populous,
    find_specimens,
    mark_kinds,
    tidy,
)
from affordance.belief.learner import Lesson, Seen, State
from affordance.belief.likelihood import Likelihood
from affordance.belief.normals import Normals

# Relative change in density below which the breadth of a new kind has converged; largest number of passes.
_SETTLED, _MAX_PASSES = 1e-5, 50


class Hypotheses(NamedTuple):
    """Hypotheses about the kinds of an object with m colours.

    The hypotheses of an observer are consecutive; they are all combinations of kinds over the object's colours.
    """

    observers: NDArray[np.intp]  # number of the observer of each hypothesis, (N,)
    kinds: NDArray[np.intp]  # index of each colour's kind, (N, m); indices from K on, one per colour, are new kinds
    probability: Array  # probability before the lift, (N,)
    densities: Normals  # densities of the object under the hypothesis, (N, m)
    founded: Mask  # True where the kind is new but not the first of its colour, (N, m)


class Verdicts(NamedTuple):
    """Hypotheses with their posterior probabilities after a lift."""

    hypotheses: Hypotheses  # hypotheses, with the breadth of new kinds evaluated after the lift
    probability: Array  # probability after the lift, (N,)
    log_evidence: Array  # log probability density of what was felt under the hypothesis, (N,)
    likelihood: Likelihood  # likelihood of the object's densities, with errors evaluated under the hypothesis
    posterior: Normals  # belief about the object's densities after the lift, (N, m)


def compute_kind_probabilities(counts: Array, concentration: Array, switching: Array, num_lifts: Array) -> Array:
    """Computes prior probabilities of K kinds and of a new kind of a colour, (B, K + 1).

    Args:
        counts: Number of other objects of each kind, (B, K).
        concentration: Concentration alpha, (B,).
        switching: Lifts of evidence c that a change of kind needs, (B,).
        num_lifts: Number of consecutive last lifts in which the object was of each kind, (B, K); zero for all kinds
            but the present one.
    """
    guests = np.column_stack([counts, concentration])
    shares = guests / guests.sum(axis=1)[:, None]
    weights = switching[:, None] * shares
    weights[:, :-1] += num_lifts
    weights /= (num_lifts.sum(axis=1) + switching)[:, None]
    return weights


def predict_new(state: State, colours: tuple[int, ...]) -> tuple[list[KindPrior], Mask]:
    """Predicts the density of a new kind of each colour.

    The first kind of a colour has the prior. The scale of a further kind is the root mean square of the mean density
    of the most populous kind, which equals the mean if that is well known. The mean alone is not enough: a kind that
    was hardly felt may have a mean close to zero by error.

    Returns:
        Prior of each colour's new kind, and True where it is a further kind, (B, colours).
    """
    believed, populous = believe_kinds(state), find_most_populous(state, colours)
    is_further = (mark_kinds(state, colours) & (count_things(state) > 0)[:, None, :]).any(axis=2)
    priors = []
    for column in range(len(colours)):
        rows, kind = np.arange(len(populous)), populous[:, column]
        scale = np.sqrt(believed.mean[rows, kind] ** 2 + believed.covariance[rows, kind, kind])
        further, spread = is_further[:, column], state["spread"]
        mean, sd = np.where(further, scale, state["prior_mode"]), np.where(further, spread * scale, state["prior_sd"])
        priors.append(KindPrior(mean, sd))
    return priors, is_further


def predict_densities(
    state: State, seen: Seen, observers: NDArray[np.intp], kinds: NDArray[np.intp], scatter_sd: Array
) -> Normals:
    """Predicts the m densities of an object, given its kinds.

    The prediction is S rho + delta. An odd object keeps its own densities, which have drifted since its last lift.

    Args:
        state: State of the observers.
        seen: Object.
        observers: Number of the observer of each of N hypotheses, (N,).
        kinds: Kind of each colour, (N, m).
        scatter_sd: SD of delta, (N, m), [kg/m^3].
    """
    believed, m = believe_kinds(state), len(seen.colours)
    rows = observers[:, None]
    covariance = believed.covariance[rows[:, :, None], kinds[:, :, None], kinds[:, None, :]]
    covariance = covariance + np.eye(m) * scatter_sd[:, None, :] ** 2
    thing = observers, seen.things[observers]
    stays = state["is_own"][thing][:, :m] & (state["thing_kind"][thing][:, :m] == kinds)
    mean = np.where(stays, state["own_mean"][thing][:, :m], believed.mean[rows, kinds])
    drift = (state["own_drift"][observers, None] * mean) ** 2
    drifted = state["own_covariance"][thing][:, :m, :m] + np.eye(m) * drift[:, None, :]
    own = np.where(stays[:, :, None] & stays[:, None, :], drifted, 0.0)
    return Normals(mean, np.where(stays[:, :, None] | stays[:, None, :], own, covariance))


def list_hypotheses(state: State, seen: Seen) -> Hypotheses:
    """Lists the hypotheses about an object: all combinations of a known or new kind for each of its colours.

    A colour with K_i kinds has K_i + 1 candidates. The state must have room for the object and, in its last places, a
    new kind for each of the object's colours.
    """
    rows, m = np.arange(len(seen.things)), len(seen.colours)
    first_new = state["is_kind"].shape[1] - m
    counts, further = count_things(state, seen.things), predict_new(state, seen.colours)[1]
    candidates: list[NDArray[np.intp]] = []
    columns: list[Array] = []
    for column, marked in enumerate(np.moveaxis(mark_kinds(state, seen.colours)[:, :, :first_new], 1, 0)):
        kinds = np.argsort(~marked, axis=1, kind="stable")[:, : int(marked.sum(axis=1).max())]
        is_there = np.take_along_axis(marked, kinds, axis=1)
        current = state["thing_kind"][rows, seen.things, column][:, None]
        num_lifts = state["num_lifts"][rows, seen.things, column][:, None]
        columns.append(
            compute_kind_probabilities(
                np.where(is_there, np.take_along_axis(counts, kinds, axis=1), 0),
                state["concentration"],
                state["switching"],
                np.where(is_there & (kinds == current), num_lifts, 0),
            )
        )
        candidates.append(np.column_stack([kinds, np.full(len(rows), first_new + column)]))
    places = np.array(list(itertools.product(*(range(each.shape[1]) for each in columns))))
    probability = np.prod([each[:, places[:, i]] for i, each in enumerate(columns)], axis=0)
    observers, chosen = np.nonzero(probability > 0.0)
    kinds = np.column_stack([each[observers, places[chosen, i]] for i, each in enumerate(candidates)])
    means = believe_kinds(state).mean[observers[:, None], kinds]
    breadth = state["kappa"][observers, None] * np.maximum(means, DENSITY_FLOOR)
    densities = predict_densities(state, seen, observers, kinds, breadth)
    founded = (kinds >= first_new) & further[observers]
    return Hypotheses(observers, kinds, probability[observers, chosen], densities, founded)


def weigh(state: State, seen: Seen, felt: Felt) -> Verdicts:
    """Computes the posterior probabilities of all hypotheses about an object.

    The evidence uses unrestricted normal distributions, as does a trial's p-value.

    Each hypothesis about m colours costs one search for the likelihood and O(m^3); each hypothesis with a further
    kind costs some more searches.
    """
    new, _ = predict_new(state, seen.colours)
    everywhere = np.ones((len(seen.things), len(seen.colours)), dtype=bool)
    hypotheses = list_hypotheses(add_kinds(state, seen.colours, new, everywhere), seen)
    hypotheses, likelihood, posterior = settle_breadth(hypotheses, felt, state["kappa"][hypotheses.observers])
    log_evidence = hypotheses.densities.compute_log_evidence(likelihood, posterior)
    log_weights = np.log(hypotheses.probability) + log_evidence
    first = np.searchsorted(hypotheses.observers, np.arange(len(seen.things)))
    weights = np.exp(log_weights - np.maximum.reduceat(log_weights, first)[hypotheses.observers])
    probability = weights / np.add.reduceat(weights, first)[hypotheses.observers]
    return Verdicts(hypotheses, probability, log_evidence, likelihood, posterior)


def settle_breadth(hypotheses: Hypotheses, felt: Felt, kappa: Array) -> tuple[Hypotheses, Likelihood, Normals]:
    """Iterates the SD of new kinds until it fits their posterior densities.

    Each pass uses the density of the previous pass; the first uses the density before the lift. If the object is
    denser than the reference, the passes rise towards the measured density without exceeding it. If it is less dense
    they converge within a few passes, as the breadth is a small part of the spread. Without a further kind one pass
    suffices.

    Returns:
        Hypotheses with these breadths, likelihoods, and beliefs about the object's densities after the lift.
    """
    observers, founded, mean = hypotheses.observers, hypotheses.founded, hypotheses.densities.mean
    covariance, rho = hypotheses.densities.covariance.copy(), mean.copy()
    left = np.arange(len(mean))
    likelihood, posterior = None, Normals(np.zeros_like(mean), np.zeros_like(covariance))
    for _ in range(_MAX_PASSES):
        belief = Normals(mean[left], covariance[left])
        found = felt.find_likelihood(belief, observers[left])
        after = belief.condition(found)
        likelihood = found if likelihood is None else likelihood.put(left, found)
        posterior.mean[left], posterior.covariance[left] = after.mean, after.covariance
        previous, rho[left] = rho[left], np.maximum(after.mean, 0.0)
        is_settled = np.abs(rho[left] - previous) <= _SETTLED * belief.mean
        changes = kappa[left, None] ** 2 * (rho[left] ** 2 - previous**2) * founded[left]
        unsettled = (founded[left] & ~is_settled).any(axis=1)
        if not unsettled.any():
            break
        left = left[unsettled]
        covariance[left] += np.eye(mean.shape[1]) * changes[unsettled][:, None, :]
    assert likelihood is not None
    return hypotheses._replace(densities=Normals(mean, covariance)), likelihood, posterior


def adopt(state: State, seen: Seen, verdicts: Verdicts, chosen: NDArray[np.intp], felt: Felt) -> Lesson:
    """Learns from the lift under the hypothesis that was chosen for each observer.

    If the object changes its kinds, its earlier holds stay with the earlier kinds.
    """
    hypotheses, rows, m = verdicts.hypotheses, np.arange(len(chosen)), len(seen.colours)
    kinds = hypotheses.kinds[chosen]
    is_adopted = hypotheses.kinds == kinds[hypotheses.observers]
    first = np.searchsorted(hypotheses.observers, rows)
    probability = np.add.reduceat(np.where(is_adopted, verdicts.probability[:, None], 0.0), first, axis=0)
    is_new = kinds >= state["is_kind"].shape[1]
    state = add_kinds(state, seen.colours, _start_broadly(state, verdicts, chosen), is_new)
    thing = rows, seen.things
    lifts = state["num_lifts"][thing][:, :m]
    same = (lifts > 0) & (state["thing_kind"][thing][:, :m] == kinds)
    values = {
        "thing_kind": kinds,
        "num_lifts": np.where(same, lifts, 0) + 1,
        "probability": probability,
        "is_own": True,
    }
    for name, value in values.items():
        state[name] = state[name].copy()
        state[name][*thing, :m] = value
    state, specimens = find_specimens(state, seen.things)
    state = add_hold(state, Seen(seen.colours, specimens), felt)
    # The deviation of a single observer, an arm, may have been changed since its last lift.
    state, own = tidy(state, seen.things, is_inferred=len(rows) > 1)
    return Lesson(state, own.select(range(m)), verdicts.likelihood.take(chosen))


def _start_broadly(state: State, verdicts: Verdicts, chosen: NDArray[np.intp]) -> list[KindPrior]:
    """Returns the prior of a new kind of each colour.

    Its SD is s times the larger of the reference and the felt density.

    With an SD of s times the reference alone, an object many times as dense would be underestimated in lift after
    lift. The SD of a colour's first kind is at least the prior's; with the prior's SD alone, dense materials would be
    underestimated, but light materials would not.
    """
    hypotheses = verdicts.hypotheses
    mean, after = hypotheses.densities.mean[chosen], verdicts.posterior.mean[chosen]
    least = np.where(hypotheses.founded[chosen], 0.0, state["prior_sd"][:, None])
    sd = np.maximum(state["spread"][:, None] * np.maximum(mean, after), least)
    return [KindPrior(mean[:, i], sd[:, i]) for i in range(mean.shape[1])]
