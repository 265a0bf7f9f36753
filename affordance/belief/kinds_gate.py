"""Gate that infers after a lift whether an object is an odd member of its kind, of another kind, or of a new one.

Before a lift the kind of an object follows a sticky Chinese restaurant process whose guests are objects. With N_k
other objects of kind k, N their sum, and n the number of lifts in which the object was of its present kind z:

    g_k = N_k / (N + alpha),   g_new = alpha / (N + alpha)
    p(z) = (n + c g_z) / (n + c),   p(k) = c g_k / (n + c),   p(new) = c g_new / (n + c)

A hypothesis h assigns a kind to each colour of the object. Under h the object's densities are S_h rho + delta, with
S_h the selection of these kinds and delta ~ N(0, diag(kappa rho_hat)^2), rho_hat the kinds' means before the lift.
The evidence of the measured torques has a closed form, and p(h) is proportional to prior times evidence. Only the
present lift counts: if evidence for odd members were accumulated over lifts, every object would end as its own kind.

A further kind of a colour has a density N(ref, (s ref)^2), ref the root mean square of the density of the colour's
most populous kind, sqrt(mean^2 + variance). There is no absolute scale, so the odds are invariant to a common factor
of all densities. The breadth of a new kind is kappa times its posterior density under the hypothesis, as with the
size of errors, since it is unknown before the lift. The first kind of a colour has the prior of all materials.

kappa is the breadth of a category and acts only here; the effect of a lift on a kind's mean is determined by the
scatter of objects within a material (``Prior.deviation_sd``). They are two numbers, not one generative model.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arguments import check_member, check_number, check_seed
from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, FindLikelihood
from affordance.belief.kinds import Kinds, KnownObject, OwnDensities
from affordance.belief.learner import Pick
from affordance.belief.likelihood import Likelihood
from affordance.files.constraints import Setting

# Change of a density, over the reference, at which the breadth of a new kind has converged; largest number of passes.
_SETTLED, _MAX_PASSES = 1e-5, 50
# Bounds of the numbers in the gate's settings, dimensionless.
_LEAST, _MOST = 1e-9, 1e9


class GateSettings(NamedTuple):
    """Settings of the gate.

    Attributes:
        kappa: Breadth of a category over its mean density.
        concentration: Concentration alpha of new kinds, in objects.
        switching: Readiness c of an object to change its kind, in lifts.
        spread: Ratio s of the SD of a further kind's density to the root mean square of the most populous kind's.
    """

    kappa: Annotated[
        float,
        Setting("1", "fitted to two groups of people, once for each way to pick (docs/decisions/0026-kinds.md)"),
    ]
    concentration: Annotated[
        float, Setting("1", "Laplace's rule of succession: as if one more object had been seen")
    ] = 1.0
    switching: Annotated[float, Setting("1", "Laplace's rule of succession: as if one more lift had been seen")] = 1.0
    spread: Annotated[float, Setting("1", "not fitted; kappa was fitted with it (docs/decisions/0026-kinds.md)")] = (
        2.0
    )


class Hypothesis(NamedTuple):
    """Hypothesis about the kinds of an object with m colours."""

    kinds: tuple[int, ...]  # index of the kind of each colour
    probability: float  # probability before the lift
    densities: DensityBelief  # of the object under the hypothesis, of size m
    founded: tuple[int, ...] = ()  # columns whose kind is new and not the first of its colour


class Verdict(NamedTuple):
    """Verdict on a hypothesis after a lift."""

    hypothesis: Hypothesis  # with the breadth of new kinds evaluated after the lift
    probability: float  # probability after the lift
    log_evidence: float  # log probability density of the measured torques under the hypothesis
    # Likelihood of the object's densities, with the size of errors evaluated under the hypothesis.
    likelihood: Likelihood
    posterior: DensityBelief  # belief about the object's densities after the lift


@dataclass(frozen=True)
class KindSettings:
    """Settings of a learner with kinds; the seed of random choices is different for each observer."""

    gate: GateSettings
    pick: Pick = Pick.MAP
    seed: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        """Checks the fields; a number of the gate that is not finite and positive raises a BadArgumentError."""
        for name, value in self.gate._asdict().items():
            check_number(name, value, _LEAST, _MOST)
        object.__setattr__(self, "pick", check_member("pick", self.pick, Pick))
        object.__setattr__(self, "seed", check_seed(self.seed))

    def pick_verdict(self, verdicts: Sequence[Verdict], lift: int) -> Verdict:
        """Picks a verdict; the number of the lift, from 1, and the seed determine random choices."""
        probabilities = np.array([verdict.probability for verdict in verdicts])
        if self.pick is Pick.MAP:
            return verdicts[int(probabilities.argmax())]
        rng = np.random.default_rng([*self.seed, lift])
        return verdicts[int(rng.choice(len(verdicts), p=probabilities))]


def compute_kind_probabilities(
    counts: NDArray[np.intp], settings: GateSettings, *, current: int | None = None, num_lifts: int = 0
) -> Array:
    """Computes the probabilities of K kinds of a colour and, last, of a new one, before a lift, shape (K + 1,).

    Counts, (K,), are of the other objects of each kind; the object itself was of the current one in its last
    num_lifts lifts, or was never lifted (None).
    """
    shares = np.append(counts, settings.concentration) / (counts.sum() + settings.concentration)
    weights: Array = settings.switching * shares
    if current is None:
        return weights / settings.switching
    weights[current] += num_lifts
    return weights / (num_lifts + settings.switching)


def list_hypotheses(kinds: Kinds, known: KnownObject, place: int | None, settings: GateSettings) -> list[Hypothesis]:
    """Lists hypotheses of positive probability on an object: a product of K_i + 1 over its colours, K_i kinds each.

    The last kinds are new, one for each of the object's colours. The place is the object's index, or None if it was
    never lifted; its memberships are then ignored.
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
    """Finds the own densities of an object that a hypothesis keeps, as the object remains of its kind."""
    stays = [column for column in known.own.columns if known.memberships[column].kind == chosen[column]]
    return known.own.restrict_to(tuple(stays))


def predict_densities(kinds: Kinds, chosen: Sequence[int], scatter_sd: Array, own: OwnDensities) -> DensityBelief:
    """Predicts m densities of an object of given kinds, S rho + delta, or its own densities where it has these.

    Each of the m colours has the index of its kind; scatter_sd is the SD of delta for each of K kinds, (K,),
    [kg/m^3].
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
    """Weighs hypotheses by the evidence of the measured torques.

    The evidence is that of unrestricted normal distributions, as in a trial's p-value. The cost is a search for the
    likelihood and O(m^3) for each hypothesis about m colours, and some more searches for each with a further kind.
    """
    verdicts = [settle_breadth(hypothesis, find_likelihood, settings.kappa) for hypothesis in hypotheses]
    log_evidences = [verdict.log_evidence for verdict in verdicts]
    log_weights = np.log([hypothesis.probability for hypothesis in hypotheses]) + log_evidences
    weights = np.exp(log_weights - log_weights.max())
    probabilities = (weights / weights.sum()).tolist()
    return [each._replace(probability=value) for each, value in zip(verdicts, probabilities, strict=True)]


def settle_breadth(hypothesis: Hypothesis, find_likelihood: FindLikelihood, kappa: float) -> Verdict:
    """Evaluates the breadth of new kinds at the posterior density under a hypothesis, by iteration.

    Each pass uses the density of the pass before, the first that before the lift. If the object is denser than the
    reference, the passes rise towards the measured density without exceeding it; if it is less dense they converge
    within a few, as the breadth is a small part of the spread. Without a further kind one pass suffices. The verdict
    has the probability before the lift.
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
    log_evidence = belief.compute_untruncated_log_evidence(likelihood, posterior)
    judged = hypothesis._replace(densities=belief)
    return Verdict(judged, hypothesis.probability, log_evidence, likelihood, posterior)


def start_kinds(verdict: Verdict, find_likelihood: FindLikelihood, spread: float) -> Verdict:
    """Returns the verdict with the SD of further kinds set to s times the larger of reference and posterior.

    The adopted hypothesis needs no gate: with an SD of s times the reference alone, an object many times as dense
    would be underestimated lift after lift.
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
    """Returns the belief with some variances changed, of densities that are independent of the others."""
    covariance = np.array(belief.covariance)
    covariance[columns, columns] += changes
    return DensityBelief.from_moments(belief.untruncated_mean, covariance)
