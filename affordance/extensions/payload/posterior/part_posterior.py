"""Posterior of the densities of a held object's seen parts, and of its unseen rest.

    pi = Phi rho + delta,    delta ~ N(0, C)

Phi is the geometry of the seen parts. The discrepancy delta consists of an unseen mass of either sign (a screw, a
cavity) anywhere in the parts' bounding box, and of errors of the measured geometry. The run gives a likelihood of
rho, which updates the densities of materials as a simulated hold does. Physically inconsistent samples are discarded.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.holds import Felt
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.belief.object_belief import ObjectBelief
from affordance.exceptions import AffordanceError
from affordance.extensions.payload.evidence.payload_likelihood import BodyLikelihood, PayloadLikelihood, factor
from affordance.extensions.payload.posterior.body_posterior import WeightedBodies, normalise
from affordance.extensions.payload.posterior.log_cholesky import is_possible
from affordance.objects.inertia import NUM_PARAMETERS, Geometry, build_transform_map, compute_point_parameters
from affordance.vision.features import ComponentFeatures

_MAX_ITERATIONS = 50
_TOLERANCE = 1e-6
_MAX_BATCHES = 50


@dataclass(frozen=True)
class SeenObject:
    """Prediction for an object from a camera and a material memory."""

    belief: ObjectBelief  # densities of the object's parts, with the geometry in the tool's frame T
    parts: tuple[ComponentFeatures, ...]  # features of its parts, in T
    low: Array  # lower corner of the parts' bounding box, in T, shape (3,), [m]
    high: Array  # upper corner of the bounding box, in T, shape (3,), [m]

    @cached_property
    def unseen(self) -> Array:
        """Covariance of the parameters of a point mass of 1 kg (one SD) anywhere in the box, (10, 10), in T."""
        nodes, weights = np.polynomial.legendre.leggauss(3)
        grid = np.stack(np.meshgrid(nodes, nodes, nodes), axis=-1).reshape(-1, 3)
        points = 0.5 * (self.low + self.high) + 0.5 * grid * (self.high - self.low)
        shares = (weights[:, None, None] * weights[:, None] * weights).ravel() / 8.0
        phi = compute_point_parameters(points).T
        covariance: Array = phi * shares @ phi.T
        return covariance

    def place(self, X_GT: Array) -> "PlacedObject":
        """Expresses the object in another frame G, with X_GT of shape (4, 4)."""
        to_G = build_transform_map(X_GT)
        geometry = self.belief.geometry
        unseen = to_G @ self.unseen @ to_G.T
        placed = Geometry(to_G @ geometry.Phi, np.einsum("ij,gjm->gim", to_G, geometry.Phi_errors))
        return PlacedObject(replace(self.belief, geometry=placed), unseen)


def add_unseen(geometry: Geometry, unseen: Array, share: float) -> Geometry:
    """Adds the discrepancy due to unseen mass to a geometry.

    Args:
        geometry: Geometry of the seen parts.
        unseen: Covariance of the parameters of 1 kg (one SD) of unseen mass, shape (10, 10).
        share: SD of the unseen mass relative to the seen mass.
    """
    errors = share * factor(unseen).T[:, :, None] * geometry.Phi[0]  # each column of the root is an independent error
    return Geometry(geometry.Phi, np.concatenate([geometry.Phi_errors, errors]))


class NotTheSeenObjectError(AffordanceError):
    """No densities of the seen parts explain the load.

    Attributes:
        p_value: Probability, under the prior, of a run at least as improbable as this run.
    """

    def __init__(self, num_possible: int, num_tried: int, p_value: float) -> None:
        """Passes all arguments on, so that the error can be pickled between processes."""
        super().__init__(num_possible, num_tried, p_value)
        self.p_value = p_value

    def __str__(self) -> str:
        num_possible, num_tried, p_value = self.args
        share = f"{num_possible} of {num_tried} samples are physically possible bodies"
        return f"the held object is not the one that was seen: {share}, p = {p_value:.1g}"


class PlacedObject(NamedTuple):
    """Seen object in the frame of the tip."""

    belief: ObjectBelief  # densities of the object's parts, with the geometry in the frame of the tip
    unseen: Array  # covariance of the parameters of 1 kg (one SD) anywhere in the box, shape (10, 10)

    def draw_parameters(self, rng: np.random.Generator, num_samples: int, share: float) -> Array:
        """Draws physically consistent bodies from the prior, at most ``num_samples``, shape (N, 10)."""
        rho = self.belief.densities.draw_samples(rng, num_samples)
        geometry = add_unseen(self.belief.geometry, self.unseen, share)
        root = factor(geometry.compute_covariance(self.belief.densities.compute_mean()))
        pi = rho @ self.belief.geometry.Phi.T + rng.standard_normal((num_samples, NUM_PARAMETERS)) @ root.T
        possible: Array = pi[is_possible(pi)]
        return possible


class PartPosterior(NamedTuple):
    """Posterior of a seen object after a run."""

    bodies: WeightedBodies  # samples of the ten parameters
    belief: ObjectBelief  # densities of the object's parts, with an updated memory of all materials
    likelihood: Likelihood  # likelihood of the densities, for callers with their own priors
    felt: Quadratic  # quadratic log likelihood of the ten parameters at the tip, without the unseen mass
    p_value: float  # probability, under the prior, of a run at least as improbable as this run


def infer_parts(
    likelihood: PayloadLikelihood,
    placed: PlacedObject,
    *,
    deviation: float,
    unseen_share: float,
    common_gain_sd: float = 0.0,
    rng: np.random.Generator,
    num_samples: int,
) -> PartPosterior:
    """Infers body and densities of a seen object from a run with Bayes' rule.

    Args:
        likelihood: Likelihood of body and load in the run.
        placed: Object that a camera saw, in the frame of the tip.
        deviation: SD of an object's density about its material's mean, as a fraction of the mean.
        unseen_share: SD of the unseen mass, as a fraction of the object's mass.
        common_gain_sd: Relative SD of a factor common to all gains, treated to first order.
        rng: Random generator.
        num_samples: Number of samples of the body.

    Raises:
        NotTheSeenObjectError: Fewer than one sample in 50 is physically consistent.
    """
    prior, Phi = placed.belief, placed.belief.geometry.Phi
    geometry = add_unseen(prior.geometry, placed.unseen, unseen_share)
    phantom = likelihood.prior.phantom_covariance
    rho = prior.densities.compute_mode()
    load = Phi @ rho
    for _ in range(_MAX_ITERATIONS):
        common = common_gain_sd**2 * np.outer(Phi @ rho, Phi @ rho)
        of_body = BodyLikelihood(likelihood, load)
        quadratic = of_body.of_body.widen(common)
        felt = Felt.from_quadratic(quadratic.restrict(np.eye(NUM_PARAMETERS)), Phi, geometry.Phi_errors)
        of_rho = felt.find_likelihood(prior.densities.normals).take(0)
        previous, rho = rho, prior.densities.condition(of_rho).compute_mode()
        discrepancy = geometry.compute_covariance(rho)
        load = of_body.of_load.find_load(Phi @ rho, discrepancy + common + phantom)
        if np.abs(rho - previous).max() <= _TOLERANCE * np.abs(rho).max():
            break
    expected = phantom + common + discrepancy + Phi @ prior.densities.covariance @ Phi.T
    p_value = prior.densities.compute_p_value(of_rho, likelihood.count_errors(load, expected))
    lesson = prior.memory.learn(felt, deviation)
    belief = replace(prior, memory=lesson.memory, densities=lesson.densities)
    pi, num_tried = _draw(quadratic, belief, discrepancy, rng, num_samples)
    if len(pi) < num_samples:
        raise NotTheSeenObjectError(len(pi), num_tried, p_value)
    # Weights correct the quadratic approximation, except if a common factor of the gains is uncertain.
    log_weights = np.zeros(len(pi))
    if common_gain_sd == 0.0:
        log_weights = of_body.compute(pi, of_body.draw_normals(rng, len(pi))) - of_body.of_body.evaluate(pi)
    bodies = WeightedBodies(pi, normalise(log_weights), np.arange(len(pi)))
    return PartPosterior(bodies, belief, of_rho, quadratic, p_value)


def _draw(
    quadratic: Quadratic, belief: ObjectBelief, discrepancy: Array, rng: np.random.Generator, num_samples: int
) -> tuple[Array, int]:
    """Draws densities and, given these, the unseen rest.

    Returns: At most ``num_samples`` consistent bodies, shape (N, 10), and the number of draws.
    """
    root = factor(discrepancy)
    inner = np.linalg.inv(np.eye(NUM_PARAMETERS) + root.T @ quadratic.precision @ root)
    spread = root @ np.linalg.cholesky(0.5 * (inner + inner.T))
    drawn: list[Array] = []
    for _ in range(_MAX_BATCHES):
        seen = belief.densities.draw_samples(rng, num_samples) @ belief.geometry.Phi.T
        delta = (quadratic.information - seen @ quadratic.precision) @ root @ inner @ root.T
        pi = seen + delta + rng.standard_normal((num_samples, NUM_PARAMETERS)) @ spread.T
        drawn.append(pi[is_possible(pi)])
        if sum(map(len, drawn)) >= num_samples:
            break
    return np.concatenate(drawn)[:num_samples], num_samples * len(drawn)
