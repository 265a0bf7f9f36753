"""Updates beliefs about densities with measured masses of objects or their parts (weighings)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.holds import Felt
from affordance.belief.learner import Seen
from affordance.belief.learners import DENSITY
from affordance.objects.inertia import Geometry
from affordance.objects.tool import Weighing
from affordance.vision.features import ComponentFeatures

# Number of standard deviations above which a weighing contradicts the belief: the object is made of other materials,
# or differs from its drawing. The threshold is the same as for outliers of lifts.
_ODD = 5.0


class WeighedObject(NamedTuple):
    """Weighed object."""

    parts: Sequence[ComponentFeatures]
    columns: Sequence[int]  # index of each part's material in the belief
    geometry: Geometry  # geometry with one column per part
    weighings: Sequence[Weighing]  # measured masses of the object or of some parts

    @property
    def materials(self) -> tuple[int, ...]:
        """Indices of the object's C different materials, in the order of its parts."""
        return tuple(dict.fromkeys(self.columns))


class Surprise(NamedTuple):
    """Weighing that contradicts the belief, with masses in [kg]."""

    name: str
    mass: float
    expected: float
    expected_sd: float


def describe_weighings(weighed: WeighedObject, materials: Sequence[int] | None = None) -> Felt:
    """Converts an object's weighings to a hold, with masses divided by their SDs in place of torques.

    All weighings and holds of the object have the same errors of the drawing.

    Args:
        weighed: Weighed object.
        materials: Indices of the materials of its C densities; None for ``weighed.materials``.
    """
    sds = np.array([each.sd for each in weighed.weighings])
    share = _mark_weighed(weighed) / sds[:, None]  # (W, K)
    order = weighed.materials if materials is None else materials
    owner = np.array(weighed.columns)[:, None] == np.array(order)  # (K, C)
    volumes = np.array([part.shape.volume for part in weighed.parts])
    masses = np.array([each.mass for each in weighed.weighings]) / sds
    errors = (share * weighed.geometry.Phi_errors[:, None, 0]) @ owner  # (G, W, C)
    return Felt.from_torques(masses[None], np.zeros(1), (share * volumes @ owner)[None], (1.0, 0.0), 1, errors[None])


def compute_mass_errors(weighed: WeighedObject, rho: Array) -> Array:
    """Computes the derivatives of weighed masses by errors of the drawing, (..., W, G), [kg].

    Args:
        weighed: Object with K parts, W weighings and G errors of its drawing.
        rho: Densities of the parts, (..., K), [kg/m^3].
    """
    slopes: Array = np.einsum("wk,gk,...k->...wg", _mark_weighed(weighed), weighed.geometry.Phi_errors[:, 0], rho)
    return slopes


def draw_drawing_errors(weighed: WeighedObject, rho: Array, rng: np.random.Generator) -> Array:
    """Draws errors of the drawing, (S, G), in units of their SDs, given weighings and densities.

    Given the densities, the weighed masses are linear in the errors e: m = V rho + G e + noise. The prior of e is
    N(0, I), so its posterior is normal. Draws from the prior would count the errors twice, because they are included
    in the likelihood of the densities.

    Args:
        weighed: Object with K parts and G errors of its drawing.
        rho: Samples of the densities of its parts, conditioned on the weighings, (S, K), [kg/m^3].
        rng: Random number generator.
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

    Weighings are treated as holds, and the posterior is computed from all of them (``affordance.belief.exact``).
    Objects are correlated through the mean densities of their materials. If a weighing contradicts the belief, the
    object may be made of any material, so the variance of the prior is added to its densities.

    Args:
        belief: Belief about the mean densities of M materials.
        objects: All N objects by name.
        prior: Prior of materials, with the deviation of objects.

    Returns:
        Joint belief of size N M, ordered by object, and the weighings that contradict the belief.
    """
    size, count = belief.size, len(objects)
    if not any(weighed.weighings for weighed in objects.values()):
        return belief.add_object_variation(prior.deviation, count), ()
    single = belief.add_object_variation(prior.deviation)
    state = DENSITY.start(np.random.default_rng(0), DENSITY.parameters, prior, size, 1)
    state = DENSITY.set_prior(state, belief.precision[None], belief.information_vector[None])
    surprises, odd, ordinary = list[Surprise](), dict[int, Felt](), dict[int, Seen]()
    for number, (name, weighed) in enumerate(objects.items()):
        if not weighed.weighings:
            continue
        felt = describe_weighings(weighed)
        if found := _find_surprises(single, name, weighed):
            surprises += found
            odd[number] = felt
        else:
            ordinary[number] = Seen(weighed.materials, np.array([len(ordinary)]))
            state = DENSITY.add(state, ordinary[number], felt)
    state, _ = DENSITY.infer(state)
    of_means = DENSITY.believe(state)
    mean, covariance = of_means.mean[0], of_means.covariance[0]
    scatter = prior.deviation**2 * (mean**2 + np.diag(covariance))
    materials = [list(weighed.materials) for weighed in objects.values()]
    # The densities of each object are a linear function of the mean densities plus an independent term.
    own_mean, slopes = np.tile(mean, (count, 1)), np.tile(np.eye(size), (count, 1, 1))
    rest = np.tile(np.diag(scatter), (count, 1, 1))
    for number, seen in ordinary.items():
        given = DENSITY.infer(state, seen)[1].given_means
        assert given is not None  # because the object is given
        columns, C = materials[number], len(materials[number])
        slopes[number, columns] = given.slopes[0, :C]
        own_mean[number, columns] = given.offset[0, :C] + given.slopes[0, :C] @ mean
        rest[np.ix_([number], columns, columns)] = given.covariance[0, :C, :C]
    for number in odd:
        rest[number] += prior.sd**2 * np.eye(size)
    F = slopes.reshape(-1, size)
    joint = DensityBelief.from_moments(own_mean.ravel(), F @ covariance @ F.T + block_diag(*rest))
    for number, felt in odd.items():
        columns = [number * size + column for column in materials[number]]
        likelihood = felt.find_likelihood(joint.normals.select(columns)).take(0)
        joint = joint.condition(likelihood.embed(columns, joint.size))
    return joint, tuple(surprises)


def condition_object(
    belief: DensityBelief, name: str, weighed: WeighedObject, prior: Prior
) -> tuple[DensityBelief, tuple[Surprise, ...]]:
    """Conditions the belief about one object on its weighings (``condition_on_weighings``)."""
    surprises = _find_surprises(belief, name, weighed)
    if surprises:
        wider = belief.covariance + prior.sd**2 * np.eye(belief.size)
        belief = DensityBelief.from_moments(belief.untruncated_mean, wider)
    columns = weighed.materials
    likelihood = describe_weighings(weighed).find_likelihood(belief.normals.select(columns)).take(0)
    return belief.condition(likelihood.embed(columns, belief.size)), tuple(surprises)


def _find_surprises(belief: DensityBelief, name: str, weighed: WeighedObject) -> list[Surprise]:
    """Finds weighings that contradict the belief about an object's densities."""
    found = []
    owner = np.array(weighed.columns)[:, None] == np.arange(belief.size)
    sums = _mark_weighed(weighed) * np.array([part.shape.volume for part in weighed.parts]) @ owner  # (W, M)
    of_drawing = compute_mass_errors(weighed, belief.untruncated_mean[list(weighed.columns)])  # (W, G)
    for each, volumes, errors in zip(weighed.weighings, sums, of_drawing, strict=True):
        expected = float(volumes @ belief.untruncated_mean)
        variance = float(volumes @ belief.covariance @ volumes + errors @ errors)
        if abs(each.mass - expected) > _ODD * np.sqrt(variance + each.sd**2):
            found.append(Surprise(name, each.mass, expected, float(np.sqrt(variance))))
    return found


def _mark_weighed(weighed: WeighedObject) -> Array:
    """Returns an array, (W, K), whose entries are 1 if a weighing includes a part, and otherwise 0."""
    parts = range(len(weighed.parts))
    return np.array([[float(not each.parts or k in each.parts) for k in parts] for each in weighed.weighings])
