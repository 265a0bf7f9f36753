"""Evidence from weighings about the densities of objects and their materials."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.inertia import Geometry
from affordance.objects.tool import Weighing
from affordance.vision.features import ComponentFeatures

# An object is odd if a weighing differs from the belief by more than this many standard deviations: it is not made of
# its materials, or differs from its drawing. The same threshold defines outliers of lifts.
_ODD = 5.0


class WeighedObject(NamedTuple):
    """Object that was weighed: its parts, the columns of their materials, and its measured masses."""

    parts: Sequence[ComponentFeatures]
    columns: Sequence[int]
    geometry: Geometry  # one column per part
    weighings: Sequence[Weighing]


class Surprise(NamedTuple):
    """Weighing that contradicts the belief; masses in [kg]."""

    name: str
    mass: float
    expected: float
    expected_sd: float


def compute_likelihood(weighed: WeighedObject, expected: Array) -> Likelihood:
    """Computes the likelihood of an object's own densities, (M,), given its weighings.

    The effect of size errors is evaluated at the expected densities.
    """
    size = len(expected)
    volumes = np.array([_sum_volumes(weighed, each, size) for each in weighed.weighings]).reshape(-1, size)
    errors = compute_mass_errors(weighed, expected[list(weighed.columns)])  # (W, G)
    covariance = np.diag([each.sd**2 for each in weighed.weighings]) + errors @ errors.T
    weights = np.linalg.solve(covariance, volumes)  # (W, M)
    masses = np.array([each.mass for each in weighed.weighings])
    return Likelihood(volumes.T @ weights, weights.T @ masses, 0.0, 0.0, len(masses))


def compute_mass_errors(weighed: WeighedObject, rho: Array) -> Array:
    """Computes how weighed masses change with the errors of the drawing, in standard deviations of these.

    Args:
        weighed: Object of K parts with W weighings and G errors of its drawing.
        rho: Densities of the parts, shape (..., K), [kg/m^3].

    Returns: Derivatives, shape (..., W, G), [kg].
    """
    is_weighed = np.array(
        [[not each.parts or k in each.parts for k in range(len(weighed.parts))] for each in weighed.weighings]
    ).reshape(-1, len(weighed.parts))
    slopes: Array = np.einsum("wk,gk,...k->...wg", is_weighed, weighed.geometry.Phi_errors[:, 0], rho)
    return slopes


def draw_drawing_errors(weighed: WeighedObject, rho: Array, rng: np.random.Generator) -> Array:
    """Draws errors of a drawing, given weighings and samples of the densities that were conditioned on these.

    Given the densities, the weighed masses are linear in the errors e, m = V rho + G e + noise, and e is a priori
    N(0, I), so that its posterior is normal too. Errors that were drawn from the prior would be counted twice: the
    likelihood of the densities has them already.

    Args:
        weighed: Object of K parts with G errors of its drawing.
        rho: Samples of the densities of its parts, shape (S, K), [kg/m^3].
        rng: Random number generator.

    Returns: Errors, shape (S, G), in standard deviations.
    """
    slopes = compute_mass_errors(weighed, rho)  # (S, W, G)
    volumes = np.array([part.shape.volume for part in weighed.parts])
    weights = slopes / np.array([each.sd**2 for each in weighed.weighings])[:, None]
    masses = [
        each.mass - sum(volumes[k] * rho[:, k] for k in range(len(volumes)) if not each.parts or k in each.parts)
        for each in weighed.weighings
    ]
    precision = np.eye(slopes.shape[-1]) + np.swapaxes(weights, -1, -2) @ slopes
    mean = np.linalg.solve(precision, np.einsum("swg,ws->sg", weights, np.array(masses))[..., None])
    noise = rng.standard_normal((*mean.shape[:2], 1))
    factor = np.linalg.cholesky(precision)
    drawn: Array = (mean + np.linalg.solve(np.swapaxes(factor, -1, -2), noise))[..., 0]
    return drawn


def condition_on_weighings(
    belief: DensityBelief, objects: Mapping[str, WeighedObject], prior: Prior
) -> tuple[DensityBelief, tuple[Surprise, ...]]:
    """Conditions the joint belief about the densities of N objects on weighings of some of them.

    An object whose weighing contradicts the belief about materials may be made of anything: the spread of its own
    densities becomes that of the prior of any material.

    Args:
        belief: Belief about the M materials' mean densities.
        objects: All N objects by name, in their order.
        prior: Prior of materials, with the deviation of objects.

    Returns: Joint belief of size N M, object by object, and the contradicting weighings.
    """
    size = belief.size
    single = belief.add_object_variation(prior.deviation)
    learned, known = belief, dict[int, Array]()
    evidence, surprises, odd = [], list[Surprise](), list[int]()
    for number, (name, weighed) in enumerate(objects.items()):
        if not weighed.weighings:
            continue
        likelihood = compute_likelihood(weighed, np.maximum(single.untruncated_mean, 0.0))
        found = _find_surprises(single, name, weighed)
        surprises += found
        odd += [number] * len(found)
        if not found:
            learned = learned.condition(likelihood.marginalise_deviation(prior.deviation))
        known[number] = likelihood.estimate_densities()
        evidence.append(likelihood.embed(range(number * size, (number + 1) * size), size * len(objects)))
    # Objects scatter as a memory has them that has learned from the weighings, one after the other.
    expected_densities = np.sqrt(learned.untruncated_mean**2 + np.diag(learned.covariance))
    densities = [known.get(number, expected_densities) for number in range(len(objects))]
    joint = belief.add_object_variation(prior.deviation, len(objects), np.concatenate(densities))
    if odd:
        covariance = joint.covariance.copy()
        for number in dict.fromkeys(odd):
            own = np.arange(number * size, (number + 1) * size)
            covariance[own, own] += prior.sd**2
        joint = DensityBelief.from_moments(joint.untruncated_mean, covariance)
    for likelihood in evidence:
        joint = joint.condition(likelihood)
    return joint, tuple(surprises)


def condition_object(
    belief: DensityBelief, name: str, weighed: WeighedObject, prior: Prior
) -> tuple[DensityBelief, tuple[Surprise, ...]]:
    """Conditions the belief about one object's own densities on its weighings; see ``condition_on_weighings``."""
    surprises = _find_surprises(belief, name, weighed)
    if surprises:
        wider = belief.covariance + prior.sd**2 * np.eye(belief.size)
        belief = DensityBelief.from_moments(belief.untruncated_mean, wider)
    # Errors of sizes count at the densities that the weighings give, as in a step of Gauss and Newton.
    posterior = belief
    for _ in range(3):
        posterior = belief.condition(compute_likelihood(weighed, np.maximum(posterior.untruncated_mean, 0.0)))
    return posterior, tuple(surprises)


def _find_surprises(belief: DensityBelief, name: str, weighed: WeighedObject) -> list[Surprise]:
    """Finds the weighings that contradict the belief about an object's own densities."""
    found = []
    for each in weighed.weighings:
        volumes = _sum_volumes(weighed, each, belief.size)
        expected = float(volumes @ belief.untruncated_mean)
        variance = float(volumes @ belief.covariance @ volumes)
        if abs(each.mass - expected) > _ODD * np.sqrt(variance + each.sd**2):
            found.append(Surprise(name, each.mass, expected, float(np.sqrt(variance))))
    return found


def _sum_volumes(weighed: WeighedObject, weighing: Weighing, size: int) -> Array:
    """Sums the volumes of the weighed parts by material, (M,), [m^3]."""
    volumes = np.zeros(size)
    for k, (part, column) in enumerate(zip(weighed.parts, weighed.columns, strict=True)):
        if not weighing.parts or k in weighing.parts:
            volumes[column] += part.shape.volume
    return volumes
