"""Sums of evidence about objects and materials, with one likelihood per object.

Each trial contributes a quadratic log likelihood of the object's ten parameters. Errors that grow with torque are
evaluated at the densities that the trial alone suggests, so that it does not depend on other trials. The quadratics
of an object's trials are summed. The errors of its geometry, and its deviation from its materials, are the same in
all its trials, so both are marginalised only once, from the sum. The likelihoods of all objects are summed in turn to
the belief about materials.

Trials with the same object name and appearance belong to one object. The same name with another appearance is another
object: "hammer", "hammer #2".
"""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities, find_colour_index
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief, Prior
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.belief.normals import Normals
from affordance.exceptions import BadArgumentError
from affordance.extensions.memory.trial_evidence import BODY, TrialEvidence
from affordance.objects.appearance import Appearance, PartAppearance, is_same_object
from affordance.objects.colour import Colour
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.proprioception.fixed_point import find_fixed_point, find_fixed_points
from affordance.proprioception.torque_noise import WeberNoise

# Largest number of materials in a memory, and of objects with one name: the effort grows with their squares.
MOST_MATERIALS, MOST_LOOKS = 200, 200


class ObjectSum(NamedTuple):
    """Sum of the evidence about one object."""

    columns: tuple[int, ...]  # index of the material of each part
    geometry: Geometry  # of the parts, as seen in the first trial
    body: Quadratic  # sum over the trials, a quadratic of the ten parameters

    @classmethod
    def start(cls, trial: TrialEvidence, columns: tuple[int, ...]) -> "ObjectSum":
        """Creates the empty sum for the object of a trial."""
        nothing = Quadratic(np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)), np.zeros(NUM_PARAMETERS))
        return cls(columns, trial.geometry, nothing)

    def add(self, found: Quadratic) -> "ObjectSum":
        """Returns the sum with the quadratic of one more trial of the object."""
        body = Quadratic(self.body.precision + found.precision, self.body.information + found.information)
        return self._replace(body=body)

    @property
    def materials(self) -> list[int]:
        """Indices of the object's materials, in increasing order."""
        return sorted(set(self.columns))

    def build_geometry(self) -> Geometry:
        """Builds the geometry with one column per material of the object."""
        materials = self.materials
        return gather(self.geometry, [materials.index(column) for column in self.columns], len(materials))

    def compute_own_likelihood(self, prior: Prior) -> Likelihood:
        """Computes the likelihood of the object's own densities, one for each of its materials."""
        geometry = self.build_geometry()
        return find_fixed_point(
            build_broad_belief(prior, len(self.materials)),
            lambda rho: self.body.widen(geometry.compute_covariance(rho)).restrict(geometry.Phi),
        )

    def compute_likelihood(self, prior: Prior) -> Likelihood:
        """Computes the likelihood of the mean densities of the object's materials."""
        size = len(self.materials)
        if not self.body.precision.any():
            return Likelihood(np.zeros((size, size)), np.zeros(size), np.nan)
        likelihood = self.compute_own_likelihood(prior).marginalise_deviation(prior.deviation)
        return Likelihood(likelihood.precision, likelihood.information_vector, np.nan)


@dataclass
class FeltThing:
    """Object that was felt: its appearance in the first trial, the sum of its evidence, and where that comes from."""

    parts: Appearance
    evidence: ObjectSum
    since: str  # time of the first trial
    trials: int = 0
    robots: set[str] = field(default_factory=set)
    # Likelihood of the mean densities of its materials; None until it is needed.
    likelihood: Likelihood | None = None

    def add(self, trial: TrialEvidence, found: Quadratic) -> None:
        """Adds a trial with the object, and its quadratic."""
        self.evidence, self.likelihood = self.evidence.add(found), None
        self.trials += 1
        self.robots.add(trial.robot)

    def compute_likelihood(self, prior: Prior) -> Likelihood:
        """Computes the likelihood of the mean densities of its materials."""
        if self.likelihood is None:
            self.likelihood = self.evidence.compute_likelihood(prior)
        return self.likelihood


@dataclass
class EvidenceSums:
    """Sums of evidence over trials, without the prior; trials must be added in the order of their times.

    Colours of materials, and objects, are in the order in which they were first met.
    """

    prior: Prior
    colours: list[Colour] = field(default_factory=list)
    things: dict[str, FeltThing] = field(default_factory=dict)
    # For each object name of a trial, the names of the objects in ``things``.
    names: dict[str, list[str]] = field(default_factory=dict)

    def add(self, trials: Sequence[TrialEvidence]) -> None:
        """Adds trials; if it fails, the evidence of none is added.

        Raises:
            BadArgumentError: If there would be too many materials, or too many objects with one name.
        """
        things = [self._meet(trial) for trial in trials]
        bodies = measure_bodies(trials, [thing.evidence.columns for thing in things], self.prior)
        for trial, thing, body in zip(trials, things, bodies, strict=True):
            thing.add(trial, body)

    def _meet(self, trial: TrialEvidence) -> FeltThing:
        """Finds the object that a trial is about; adds it if it was never met."""
        for name in self.names.get(trial.object_name, ()):
            if is_same_object(self.things[name].parts, trial.parts):
                return self.things[name]
        columns = tuple(self._recognise(part) for part in trial.parts)
        thing = FeltThing(trial.parts, ObjectSum.start(trial, columns), trial.time)
        self.things[self._name(trial.object_name)] = thing
        return thing

    def build_belief(self) -> DensityBelief:
        """Builds the belief about the mean densities of the materials."""
        start = EMPTY_BELIEF.extend(self.prior, len(self.colours))
        precision, information = start.precision.copy(), start.information_vector.copy()
        for thing in self.things.values():
            materials, likelihood = thing.evidence.materials, thing.compute_likelihood(self.prior)
            precision[np.ix_(materials, materials)] += likelihood.precision
            information[materials] += likelihood.information_vector
        return DensityBelief(0.5 * (precision + precision.T), information)

    def _name(self, object_name: str) -> str:
        """Chooses a unique name for a new object."""
        met = self.names.setdefault(object_name, [])
        if len(met) == MOST_LOOKS:
            problem = f"is {object_name!r}, the name of {MOST_LOOKS} different objects already, must be another name"
            raise BadArgumentError("object", "", problem)
        numbered = (f"{object_name} #{number}" for number in itertools.count(2))
        name = next(each for each in itertools.chain([object_name], numbered) if each not in self.things)
        met.append(name)
        return name

    def _recognise(self, part: PartAppearance) -> int:
        """Finds the index of a part's material by its colour; a new material is added."""
        column = find_material(part, self.colours)
        if column is None:
            column = len(self.colours)
            if column == MOST_MATERIALS:
                problem = f"are of {column + 1} materials, must be of at most {MOST_MATERIALS}"
                raise BadArgumentError("colours", "", problem)
            self.colours.append(part.colour)
        return column


def find_material(part: PartAppearance, colours: Sequence[Colour]) -> int | None:
    """Finds the index of a part's material by its colour; None if no colour is recognised with certainty."""
    if part.colour_sd == 0.0:
        return find_colour_index(colours, part.colour)
    probabilities = compute_colour_probabilities(part.colour, part.colour_sd, colours, part.lightness_sd)
    best = int(np.argmax(probabilities))
    return best if best < len(colours) and probabilities[best] >= CERTAIN else None


def measure_bodies(
    trials: Sequence[TrialEvidence], columns: Sequence[Sequence[int]], prior: Prior
) -> list[Quadratic]:
    """Computes each trial's quadratic log likelihood of the ten parameters; ``columns`` are materials of its parts.

    Errors that grow with torque are evaluated at the densities that fit this trial alone. Trials with one such noise
    model, and equally many joints, materials and errors of the geometry, are computed together.
    """
    groups: dict[object, list[int]] = {}
    geometries = []
    for i, (trial, own) in enumerate(zip(trials, columns, strict=True)):
        materials = sorted(set(own))
        geometry = gather(trial.geometry, [materials.index(column) for column in own], len(materials))
        geometries.append(geometry)
        key = (trial.model, trial.num_joints, geometry.Phi_errors.shape) if isinstance(trial.model, WeberNoise) else i
        groups.setdefault(key, []).append(i)
    found: dict[int, Quadratic] = {}
    for rows in groups.values():
        chosen, seen = [trials[i] for i in rows], [geometries[i] for i in rows]
        measure = _measure_felt if isinstance(chosen[0].model, WeberNoise) else _measure_one
        found |= zip(rows, measure(chosen, seen, prior), strict=True)
    return [found[i] for i in range(len(trials))]


def _measure_one(trials: Sequence[TrialEvidence], geometries: Sequence[Geometry], prior: Prior) -> list[Quadratic]:
    """Computes the quadratic of a trial with any model."""
    (trial,), (geometry,) = trials, geometries
    broad = build_broad_belief(prior, geometry.Phi.shape[1])
    likelihood = find_fixed_point(broad, lambda rho: trial.compute_likelihood(geometry, rho))
    rho = broad.condition(likelihood).untruncated_mean
    of_body = trial.compute_likelihood(BODY, geometry.Phi @ rho)
    return [Quadratic(of_body.precision, of_body.information_vector)]


def _measure_felt(trials: Sequence[TrialEvidence], geometries: Sequence[Geometry], prior: Prior) -> list[Quadratic]:
    """Computes the quadratics of N trials with one Weber noise, whose arrays have the same shapes."""
    noise, J, N = trials[0].model, trials[0].num_joints, len(trials)
    assert isinstance(noise, WeberNoise)
    features = np.array([trial.features for trial in trials])
    tau_arm, Y = features[:, J : 2 * J], features[:, 2 * J :].reshape(N, J, NUM_PARAMETERS)
    residual = features[:, :J] - tau_arm
    Phi, errors = (np.array([getattr(each, name) for each in geometries]) for name in ("Phi", "Phi_errors"))
    regressor = Y @ Phi  # (N, J, M)
    num_percepts = np.array([trial.num_samples if noise.independent_samples else 1 for trial in trials])

    def compute_variances(predicted: Array, rows: NDArray[np.intp]) -> Array:
        variances: Array = noise.threshold**2 + (noise.weber_fraction * predicted) ** 2
        variances /= num_percepts[rows, None]
        return variances

    def weigh(covariance: Array, regressor: Array, residual: Array) -> Likelihood:
        weighted = np.linalg.solve(covariance, np.concatenate([regressor, residual[..., None]], axis=-1))
        transposed = np.swapaxes(regressor, 1, 2)
        precision, information_vector = transposed @ weighted[..., :-1], np.matvec(transposed, weighted[..., -1])
        return Likelihood(precision, information_vector, np.nan)

    def compute_likelihoods(rho: Array, rows: NDArray[np.intp]) -> Likelihood:
        predicted = tau_arm[rows] + np.matvec(regressor[rows], rho)
        covariance = compute_variances(predicted, rows)[..., None] * np.eye(J)
        if errors.shape[1]:
            spread = np.matvec(errors[rows], rho[:, None, :])  # (n, G, 10)
            covariance += Y[rows] @ (np.swapaxes(spread, 1, 2) @ spread) @ np.swapaxes(Y[rows], 1, 2)
        return weigh(covariance, regressor[rows], residual[rows])

    everyone = np.arange(N)
    broad = build_broad_belief(prior, Phi.shape[2])
    normals = Normals(
        np.tile(broad.untruncated_mean, (N, 1)),
        np.tile(broad.covariance, (N, 1, 1)),
        (np.tile(broad.precision, (N, 1, 1)), np.tile(broad.information_vector, (N, 1))),
    )
    rho = normals.condition(find_fixed_points(normals, everyone, compute_likelihoods)).mean
    predicted = tau_arm + np.matvec(Y, np.matvec(Phi, rho))
    of_bodies = weigh(compute_variances(predicted, everyone)[..., None] * np.eye(J), Y, residual)
    return [Quadratic(*each) for each in zip(of_bodies.precision, of_bodies.information_vector, strict=True)]


@functools.lru_cache(maxsize=64)
def build_broad_belief(prior: Prior, size: int) -> DensityBelief:
    """Builds the belief about the densities of an object whose ``size`` materials were never felt."""
    return EMPTY_BELIEF.extend(prior, size).add_object_variation(prior.deviation)


def gather(geometry: Geometry, columns: Sequence[int], size: int) -> Geometry:
    """Combines the columns of parts that share a material; ``columns`` is the material of each part."""
    selection = np.zeros((len(columns), size))
    selection[np.arange(len(columns)), list(columns)] = 1.0
    return Geometry(geometry.Phi @ selection, geometry.Phi_errors @ selection)
