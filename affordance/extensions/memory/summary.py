"""Summary of a lasting memory: beliefs about its materials and objects, and the trials behind them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.felt_object import FeltObject
from affordance.belief.learner import Learner
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.extensions.memory.evidence_sums import EvidenceSums, FeltThing
from affordance.extensions.memory.ledger import Ledger
from affordance.objects.colour import Colour

_FRACTIONS = (0.05, 0.5, 0.95)


class ExperienceSummary(NamedTuple):
    """Experience behind a belief: number of trials, robots, and UTC time of the first trial, ISO 8601."""

    trials: int
    robots: tuple[str, ...]
    since: str


class KnownMaterial(NamedTuple):
    """Belief about the mean density of a material: median and 90 % interval, [kg/m^3], and objects that show it."""

    colour: Colour
    median: float
    interval90: tuple[float, float]
    things: tuple[str, ...]
    experience: ExperienceSummary


class KnownThing(NamedTuple):
    """Belief about an object: mean and SD of its mass, [kg], and median density of each material, [kg/m^3]."""

    name: str
    mass: float
    mass_sd: float
    densities: tuple[float, ...]
    experience: ExperienceSummary


class MemorySummary(NamedTuple):
    """Materials and objects of a memory, in the order in which they were first met."""

    materials: tuple[KnownMaterial, ...]
    things: tuple[KnownThing, ...]


def summarise(ledger: Ledger, prior: Prior) -> MemorySummary:
    """Summarises a memory for a learner with one density per colour.

    Arguments and errors are those of ``Ledger.recall``.
    """
    sums = ledger.sum(prior)
    with ledger.blame():
        belief = sums.build_belief()
        low, median, high = belief.compute_percentiles(_FRACTIONS) if sums.colours else np.zeros((3, 0))
        materials = []
        for i, colour in enumerate(sums.colours):
            shown = {name: thing for name, thing in sums.things.items() if i in thing.evidence.columns}
            interval = float(low[i]), float(high[i])
            experience = _describe(list(shown.values()))
            materials.append(KnownMaterial(colour, float(median[i]), interval, tuple(shown), experience))
        known = tuple(
            _describe_thing(name, thing, belief, prior)
            for name, thing in sums.things.items()
            if thing.evidence.body.precision.any()
        )
    return MemorySummary(tuple(materials), known)


def recall_felt(ledger: Ledger, prior: Prior) -> dict[str, FeltObject]:
    """Computes the evidence about each object, by its name, with one density per colour of its parts.

    Arguments and errors are those of ``Ledger.recall``.
    """
    sums = ledger.sum(prior)
    with ledger.blame():
        return {name: _describe_felt(thing, sums, prior) for name, thing in sums.things.items()}


def recall_with_objects(ledger: Ledger, learner: Learner, prior: Prior, seed: Seed) -> MaterialMemory:
    """Recalls a learner's belief together with the evidence about each object, so that none is counted twice.

    Arguments and errors are those of ``Ledger.recall``, whose result for one density per colour has no objects.
    """
    memory = ledger.recall(learner, prior, seed=seed)
    if learner.name != "density":
        return memory
    felt = [each for each in recall_felt(ledger, prior).values() if each.own.precision.any()]
    return MaterialMemory.from_belief(memory.colours, memory.belief, felt)


def _describe_felt(thing: FeltThing, sums: EvidenceSums, prior: Prior) -> FeltObject:
    """Collects the evidence about an object, with its materials in the order of its parts."""
    evidence, shared = thing.evidence, thing.compute_likelihood(prior)
    columns = tuple(dict.fromkeys(evidence.columns))
    order = [evidence.materials.index(column) for column in columns]
    own = Likelihood(np.zeros_like(shared.precision), np.zeros(len(order)), 0.0)
    if evidence.body.precision.any():
        own = evidence.compute_own_likelihood(prior)
    looks = zip(thing.parts, evidence.columns, strict=True)
    return FeltObject(
        tuple(sums.colours[column] for column in columns),
        own.select(order),
        shared.select(order),
        tuple(part._replace(colour=sums.colours[column]) for part, column in looks),
    )


def _describe_thing(name: str, thing: FeltThing, belief: DensityBelief, prior: Prior) -> KnownThing:
    """Summarises an object from the other objects' evidence about its materials, and its own, counted once."""
    chosen = thing.evidence.materials
    own, shared = thing.evidence.compute_own_likelihood(prior), thing.compute_likelihood(prior)
    told = shared.embed(chosen, belief.size)
    others = DensityBelief(belief.precision - told.precision, belief.information_vector - told.information_vector)
    before = others.select(chosen).add_object_variation(prior.deviation, densities=own.estimate_densities())
    densities = before.condition(own)
    # The mass is that of the whole body given the evidence, including any parts that were not seen.
    geometry = thing.evidence.build_geometry()
    C = geometry.Phi @ before.covariance @ geometry.Phi.T + geometry.compute_covariance(densities.compute_mean())
    H, b = thing.evidence.body.precision, thing.evidence.body.information
    start = geometry.Phi @ before.untruncated_mean
    covariance = np.linalg.solve(np.eye(len(C)) + C @ H, C)
    mass = float((start + covariance @ (b - H @ start))[0])
    medians = tuple(float(each) for each in densities.compute_percentiles([0.5])[0])
    return KnownThing(name, mass, float(np.sqrt(covariance[0, 0])), medians, _describe([thing]))


def _describe(things: Sequence[FeltThing]) -> ExperienceSummary:
    return ExperienceSummary(
        sum(thing.trials for thing in things),
        tuple(sorted({robot for thing in things for robot in thing.robots})),
        min((thing.since for thing in things), default=""),
    )
