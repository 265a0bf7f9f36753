"""Sums of evidence about objects and materials: one likelihood an object, its own deviation marginalised once.

Every trial is a quadratic log likelihood of the object's ten parameters; errors that grow with torque are evaluated
at the densities that the trial alone suggests, so that it does not depend on other trials. The quadratics of an
object's trials add up. Errors of its geometry and its deviation from its materials are the same in all of them, so
both are marginalised once, in the sum. Sums of objects add up again, in any order, to the belief about materials.
"""

import functools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.colour_recognition import CERTAIN, compute_colour_probabilities, find_colour_index
from affordance.belief.density_belief import EMPTY_BELIEF, DensityBelief, Prior
from affordance.belief.likelihood import Likelihood, Quadratic
from affordance.memory.felt_models import MeanDensities
from affordance.memory.trial_evidence import BODY, TrialEvidence
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour
from affordance.objects.inertia import NUM_PARAMETERS, Geometry
from affordance.proprioception.fixed_point import find_fixed_point


class ObjectSum(NamedTuple):
    """Sum of the evidence about one object."""

    columns: tuple[int, ...]  # index of the material of each part
    geometry: Geometry  # of the parts, as seen in the first trial
    body: Quadratic  # sum over the trials, a quadratic of the ten parameters
    # Sum over trials that are about means of materials: precision (P, P) and information vector (P,).
    means: tuple[Array, Array]

    @classmethod
    def start(cls, trial: TrialEvidence, columns: tuple[int, ...]) -> "ObjectSum":
        """Returns the empty sum of the object of a trial."""
        size = len(columns)
        nothing = Quadratic(np.zeros((NUM_PARAMETERS, NUM_PARAMETERS)), np.zeros(NUM_PARAMETERS))
        return cls(columns, trial.geometry, nothing, (np.zeros((size, size)), np.zeros(size)))

    @classmethod
    def of(cls, trials: Sequence[TrialEvidence], columns: tuple[int, ...], prior: Prior) -> "ObjectSum":
        """Returns the sum of all trials of an object."""
        return functools.reduce(lambda total, trial: total.add(trial, prior), trials, cls.start(trials[0], columns))

    def add(self, trial: TrialEvidence, prior: Prior) -> "ObjectSum":
        """Returns the sum with another trial of the object."""
        if isinstance(trial.model, MeanDensities):
            likelihood = trial.compute_likelihood(trial.geometry, np.zeros(len(self.columns)))
            precision, information = self.means
            means = precision + likelihood.precision, information + likelihood.information_vector
            return self._replace(means=means)
        found = measure_body(trial, self.columns, prior)
        body = Quadratic(self.body.precision + found.precision, self.body.information + found.information)
        return self._replace(body=body)

    @property
    def materials(self) -> list[int]:
        """Indices of the object's materials, increasing."""
        return sorted(set(self.columns))

    def build_geometry(self) -> Geometry:
        """Builds the geometry with a column for each of the object's materials."""
        materials = self.materials
        return gather(self.geometry, [materials.index(column) for column in self.columns], len(materials))

    def compute_own_likelihood(self, prior: Prior) -> Likelihood:
        """Computes the likelihood of the object's own densities, for each of its materials."""
        geometry = self.build_geometry()
        return find_fixed_point(
            build_broad_belief(prior, len(self.materials)),
            lambda rho: self.body.widen(geometry.compute_covariance(rho)).restrict(geometry.Phi),
        )

    def compute_likelihood(self, prior: Prior) -> Likelihood:
        """Computes the likelihood of the mean densities of the object's materials."""
        selection = np.array([[float(column == material) for material in self.materials] for column in self.columns])
        precision, information = selection.T @ self.means[0] @ selection, selection.T @ self.means[1]
        if self.body.precision.any():
            likelihood = self.compute_own_likelihood(prior).marginalise_deviation(prior.deviation_sd)
            precision = precision + likelihood.precision
            information = information + likelihood.information_vector
        return Likelihood(precision, information, np.nan)


class MaterialSum:
    """Sum of the evidence about M materials, over objects, without the prior of materials never felt.

    It is a precision, (M, M), and an information vector, (M,), of materials in the order in which they were met.
    """

    def __init__(
        self,
        prior: Prior,
        colours: Sequence[Colour] = (),
        precision: Array | None = None,
        information: Array | None = None,
    ) -> None:
        """Starts a sum, empty unless colours and sums are given."""
        self.prior = prior
        self.colours = tuple(colours)
        size = len(self.colours)
        self.precision = np.zeros((size, size)) if precision is None else precision
        self.information = np.zeros(size) if information is None else information

    def recognise(self, parts: Sequence[PartAppearance]) -> tuple[int, ...]:
        """Finds the material of each part by its colour, and adds those that were never met."""
        columns = []
        for part in parts:
            column = find_material(part, self.colours)
            if column is None:
                column = len(self.colours)
                self.colours = (*self.colours, part.colour)
                self.precision = np.pad(self.precision, (0, 1))
                self.information = np.append(self.information, 0.0)
            columns.append(column)
        return tuple(columns)

    def add(self, of_object: ObjectSum, sign: float = 1.0) -> None:
        """Adds the evidence about an object, or with the sign -1 removes it."""
        materials = of_object.materials
        likelihood = of_object.compute_likelihood(self.prior)
        self.precision[np.ix_(materials, materials)] += sign * likelihood.precision
        self.information[materials] += sign * likelihood.information_vector

    def build_belief(self) -> DensityBelief:
        """Builds the belief about the mean densities of the materials."""
        start = EMPTY_BELIEF.extend(self.prior, len(self.colours))
        precision = start.precision + 0.5 * (self.precision + self.precision.T)
        return DensityBelief(precision, start.information_vector + self.information)


def find_material(part: PartAppearance, colours: Sequence[Colour]) -> int | None:
    """Finds the material of a part by its colour; None if no colour is recognised with certainty."""
    if part.colour_sd == 0.0:
        return find_colour_index(colours, part.colour)
    probabilities = compute_colour_probabilities(part.colour, part.colour_sd, colours, part.lightness_sd)
    best = int(np.argmax(probabilities))
    return best if best < len(colours) and probabilities[best] >= CERTAIN else None


def measure_body(trial: TrialEvidence, columns: Sequence[int], prior: Prior) -> Quadratic:
    """Computes a trial's quadratic of the ten parameters, errors evaluated at the densities that fit it alone."""
    materials = sorted(set(columns))
    geometry = gather(trial.geometry, [materials.index(column) for column in columns], len(materials))
    broad = build_broad_belief(prior, len(materials))
    likelihood = find_fixed_point(broad, lambda rho: trial.compute_likelihood(geometry, rho))
    rho = broad.condition(likelihood).untruncated_mean
    of_body = trial.compute_likelihood(BODY, geometry.Phi @ rho)
    return Quadratic(of_body.precision, of_body.information_vector)


def sum_objects(groups: Iterable[Sequence[TrialEvidence]], prior: Prior) -> MaterialSum:
    """Sums the evidence of objects, each with its trials, in the order in which colours are to be met."""
    total = MaterialSum(prior)
    for trials in groups:
        total.add(ObjectSum.of(trials, total.recognise(trials[0].parts), prior))
    return total


def build_broad_belief(prior: Prior, size: int) -> DensityBelief:
    """Builds the belief about an object of a number of materials that were never felt."""
    return EMPTY_BELIEF.extend(prior, size).add_object_variation(prior.deviation_sd)


def gather(geometry: Geometry, columns: Sequence[int], size: int) -> Geometry:
    """Returns the geometry with a column for each material, given the material of each part."""
    selection = np.zeros((len(columns), size))
    selection[np.arange(len(columns)), list(columns)] = 1.0
    return Geometry(geometry.Phi @ selection, geometry.Phi_errors @ selection)
