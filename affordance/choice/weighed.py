"""Evidence of weighings: what measured masses say of the densities of objects and their materials."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.objects.inertia import Geometry
from affordance.objects.weighing import Weighing
from affordance.vision.features import ComponentFeatures

# Distance between a weighing and what was believed, in standard deviations, above which the object is odd: it is not
# of its materials, or not as it is drawn. Outliers of lifts are counted from the same distance.
_ODD = 5.0


class WeighedObject(NamedTuple):
    """Object that was weighed: its parts, columns of their materials, and measured masses."""

    parts: Sequence[ComponentFeatures]
    columns: Sequence[int]
    geometry: Geometry  # columns are materials
    weighings: Sequence[Weighing]


class Surprise(NamedTuple):
    """Weighing that contradicts what was believed, [kg]."""

    name: str
    mass: float
    expected: float
    expected_sd: float


def compute_likelihood(weighed: WeighedObject, expected: Array) -> Likelihood:
    """Computes the likelihood of an object's own densities, (M,); sizes have errors at the expected densities."""
    size = weighed.geometry.Phi.shape[1]
    found = Likelihood(np.zeros((size, size)), np.zeros(size), 0.0)
    errors_of_mass = weighed.geometry.Phi_errors[:, 0] @ expected  # (G,), [kg] per standard deviation
    for each in weighed.weighings:
        volumes = _sum_volumes(weighed, each, size)
        variance = each.sd**2 + float(errors_of_mass @ errors_of_mass)
        own = Likelihood(np.outer(volumes, volumes) / variance, volumes * each.mass / variance, 0.0)
        found = found.add(own._replace(log_peak=0.0, num_values=1))
    return found


def condition_on_weighings(
    belief: DensityBelief, objects: Mapping[str, WeighedObject], prior: Prior
) -> tuple[DensityBelief, tuple[Surprise, ...]]:
    """Conditions the joint belief about the densities of N objects on weighings of some of them.

    An object whose weighing contradicts the belief about materials may be of anything: its own densities scatter
    about its materials' as those of any material do.

    Args:
        belief: Belief about the M materials' mean densities.
        objects: All N objects by name, in their order.
        prior: Prior of materials, with the deviation of objects.

    Returns: Joint belief, of size N M, object by object, and the contradictions.
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
    """Conditions the belief about one object's own densities on its weighings, as ``condition_on_weighings`` does."""
    surprises = _find_surprises(belief, name, weighed)
    likelihood = compute_likelihood(weighed, np.maximum(belief.untruncated_mean, 0.0))
    if surprises:
        wider = belief.covariance + prior.sd**2 * np.eye(belief.size)
        belief = DensityBelief.from_moments(belief.untruncated_mean, wider)
    return belief.condition(likelihood), tuple(surprises)


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
