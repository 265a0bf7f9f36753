"""Computes which kind a lifted object belongs to: its present kind, another known kind, or a new kind.

A kind is a cluster of objects of one colour that share a mean density. The prior of an object's kind is a sticky
Chinese restaurant process. Let N_k be the number of other objects of kind k, N the sum of N_k over the colour's
kinds, z the object's present kind, and n the number of consecutive lifts in which the object belonged to z. Then

    g_k = N_k / (N + alpha),   g_new = alpha / (N + alpha)
    p(z) = (n + c g_z) / (n + c),   p(k) = c g_k / (n + c),   p(new) = c g_new / (n + c)

A hypothesis h assigns a kind to each colour of the object. Under h, the object's densities are S_h rho + delta. The
matrix S_h selects the mean densities of these kinds. The scatter is delta ~ N(0, diag(kappa rho_hat)^2), where
rho_hat is the mean before the lift. Laplace's method gives the evidence of the measured torques, and p(h) is
proportional to prior times evidence. Evidence from earlier lifts is not accumulated, because each object would then
become a kind of its own.

A further kind of a colour has the prior N(ref, (s ref)^2), where ref = sqrt(mean^2 + variance) is the root mean
square density of the colour's most populous kind. There is no absolute scale: if all densities are scaled, the odds
do not change. The density of a further kind is unknown before the lift, so the SD of delta is then kappa times its
posterior density. The first kind of a colour has the prior of all materials. If a new kind is adopted, it starts with
an SD of s times its density; for a first kind, the SD is at least the prior's.

kappa is only used to compare hypotheses. Predictions before a lift, and the update of a kind's mean, use the scatter
of objects within a material instead (``Prior.deviation``). The two parameters do not belong to one generative model.
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

# Relative change in density at which the iteration of ``settle_breadth`` stops, and its largest number of passes.
_SETTLED, _MAX_PASSES = 1e-5, 50


class Hypotheses(NamedTuple):
    """Hypotheses about the kinds of one object with m colours, for all observers.

    Each observer has one hypothesis for each combination of kinds. The hypotheses of one observer are consecutive.
    """

    observers: NDArray[np.intp]  # number of the observer of each hypothesis, (N,)
    kinds: NDArray[np.intp]  # index of each colour's kind, (N, m); index K + i is a new kind of colour i
    probability: Array  # probability before the lift, (N,)
    densities: Normals  # densities of the object under the hypothesis, (N, m)
    founded: Mask  # True where the kind is new and its colour already has lifted objects, (N, m)


class Verdicts(NamedTuple):
    """Hypotheses with their posterior probabilities after a lift."""

    hypotheses: Hypotheses  # hypotheses, with the scatter of further kinds evaluated after the lift
    probability: Array  # probability after the lift, (N,)
    log_evidence: Array  # log probability density of the measured torques under the hypothesis, (N,)
    likelihood: Likelihood  # likelihood of the object's densities, expanded at the posterior mode
    posterior: Normals  # belief about the object's densities after the lift, (N, m)


def compute_kind_probabilities(counts: Array, concentration: Array, switching: Array, num_lifts: Array) -> Array:
    """Computes the prior probabilities of one colour's kinds.

    Args:
        counts: Number of other objects of each kind, (B, K).
        concentration: Concentration alpha, (B,).
        switching: Weight c of the other objects against the object's own lifts, (B,).
        num_lifts: Number n of consecutive lifts in which the object belonged to its present kind; zero for all other
            kinds, (B, K).

    Returns:
        Probabilities of K kinds and, last, of a new kind, (B, K + 1).
    """
    guests = np.column_stack([counts, concentration])
    shares = guests / guests.sum(axis=1)[:, None]
    weights = switching[:, None] * shares
    weights[:, :-1] += num_lifts
    weights /= (num_lifts.sum(axis=1) + switching)[:, None]
    return weights


def predict_new(state: State, colours: tuple[int, ...]) -> tuple[list[KindPrior], Mask]:
    """Computes the prior of a new kind for each colour.

    The first kind of a colour has the prior of all materials. The scale of a further kind is the root mean square
    density of the most populous kind. The mean is not suitable: after few measurements it may be close to zero.

    Returns:
        Prior of each colour's new kind, and True where the colour already has lifted objects, (B, colours).
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
    """Predicts the densities of an object from its kinds, as S rho + delta.

    If the object keeps its kind and has a belief about its own densities, that belief is used, with drift added.

    Args:
        state: State of the observers.
        seen: Object with m colours.
        observers: Observer number for each of N hypotheses, (N,).
        kinds: Kind of each colour, (N, m).
        scatter_sd: SD of delta, (N, m), [kg/m^3].

    Returns:
        Normal distributions of the densities, (N, m), [kg/m^3].
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
    """Lists all combinations of known and new kinds over the colours of an object.

    The arrays of the state must have room for the object and, in their last places, for one new kind per colour.
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

    The evidence is computed without the restriction to positive densities.
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
    """Iterates the scatter SD of further kinds until it equals kappa times their posterior density.

    Each pass uses the density from the previous pass; the first pass uses the density before the lift. One pass is
    enough for hypotheses without further kinds. For an object denser than the reference, the density rises towards
    the measured density without exceeding it. For a less dense object, a few passes are enough.

    Returns:
        Hypotheses with the final scatter, likelihoods, and beliefs about the object's densities after the lift.
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
    """Updates the state with a lift, given the chosen hypothesis for each observer.

    If the object changes its kinds, its earlier holds remain evidence for the earlier kinds.
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
    # For a single observer, which may be an arm, the parameter ``deviation`` may have changed since the last lift.
    state, own = tidy(state, seen.things, is_inferred=len(rows) > 1)
    return Lesson(state, own.select(range(m)), verdicts.likelihood.take(chosen))


def _start_broadly(state: State, verdicts: Verdicts, chosen: NDArray[np.intp]) -> list[KindPrior]:
    """Returns the prior of an adopted new kind of each colour.

    The SD is s times the larger of the reference and the posterior density. With s times the reference alone, an
    object many times denser would be underestimated over many lifts. For the first kind of a colour, the SD is at
    least the prior's. With the prior's SD alone, dense materials would be underestimated, but light materials would
    not.
    """
    hypotheses = verdicts.hypotheses
    mean, after = hypotheses.densities.mean[chosen], verdicts.posterior.mean[chosen]
    least = np.where(hypotheses.founded[chosen], 0.0, state["prior_sd"][:, None])
    sd = np.maximum(state["spread"][:, None] * np.maximum(mean, after), least)
    return [KindPrior(mean[:, i], sd[:, i]) for i in range(mean.shape[1])]
