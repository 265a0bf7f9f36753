"""Summary of a lasting memory: belief about each material and each thing, and the experience behind it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arguments import Seed
from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.learner import Learner
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import HeldObject, MaterialMemory
from affordance.belief.object_belief import FeltObject, Memory
from affordance.memory.evidence_sums import MaterialSum, ObjectSum
from affordance.memory.felt_models import MeanDensities
from affordance.memory.ledger import Ledger
from affordance.memory.same_colours import SameColours
from affordance.memory.trial_evidence import TrialEvidence
from affordance.objects.colour import Colour

_FRACTIONS = (0.05, 0.5, 0.95)


class ExperienceSummary(NamedTuple):
    """Experience from which something is believed: trials, robots, and UTC time of the first trial, ISO 8601."""

    trials: int
    robots: tuple[str, ...]
    since: str


class KnownMaterial(NamedTuple):
    """Belief about the mean density of a material, [kg/m^3]: median and interval of 90 %, and things that show it."""

    colour: Colour
    median: float
    interval90: tuple[float, float]
    things: tuple[str, ...]
    experience: ExperienceSummary


class KnownThing(NamedTuple):
    """Belief about a thing: mean and SD of its mass, [kg], and medians of its densities by material, [kg/m^3]."""

    name: str
    mass: float
    mass_sd: float
    densities: tuple[float, ...]
    experience: ExperienceSummary


class MemorySummary(NamedTuple):
    """Materials and things of a memory, in the order they were first met."""

    materials: tuple[KnownMaterial, ...]
    things: tuple[KnownThing, ...]


def summarise(ledger: Ledger, prior: Prior, same_colours: SameColours = ()) -> MemorySummary:
    """Summarises a memory for a learner with one density for each colour."""
    trials = dict(ledger.walk_things(same_colours))
    total, sums = MaterialSum(prior), {}
    for thing, group in trials.items():
        sums[thing] = ObjectSum.of(group, total.recognise(group[0].parts), prior)
        total.add(sums[thing])
    belief = total.build_belief()
    low, median, high = belief.compute_percentiles(_FRACTIONS) if total.colours else np.zeros((3, 0))
    materials = []
    for i, colour in enumerate(total.colours):
        things = tuple(thing for thing, of_object in sums.items() if i in of_object.columns)
        felt = [trial for thing in things for trial in trials[thing]]
        interval = float(low[i]), float(high[i])
        materials.append(KnownMaterial(colour, float(median[i]), interval, things, _describe(felt)))
    known = tuple(
        _describe_thing(thing, of_object, trials[thing], belief, prior)
        for thing, of_object in sums.items()
        if not isinstance(trials[thing][0].model, MeanDensities)
    )
    return MemorySummary(tuple(materials), known)


def recall_felt(ledger: Ledger, prior: Prior, same_colours: SameColours = ()) -> dict[str, FeltObject]:
    """Recalls by its name the evidence about each thing, with a density for each colour of its parts.

    Colours that count as one, and errors, are those of ``Ledger.recall``.
    """
    found = {}
    total = MaterialSum(prior)
    for thing, trials in ledger.walk_things(same_colours):
        of_object = ObjectSum.of(trials, total.recognise(trials[0].parts), prior)
        columns = tuple(dict.fromkeys(of_object.columns))
        order = [of_object.materials.index(column) for column in columns]
        shared = of_object.compute_likelihood(prior)
        own = Likelihood(np.zeros_like(shared.precision), np.zeros(len(order)), 0.0)
        if of_object.body.precision.any():
            own = of_object.compute_own_likelihood(prior)
        found[thing] = FeltObject(
            tuple(total.colours[column] for column in columns),
            own.select(order),
            shared.select(order),
            tuple(
                part._replace(colour=total.colours[column])
                for part, column in zip(trials[0].parts, of_object.columns, strict=True)
            ),
        )
    return found


def recall_with_objects(
    ledger: Ledger, learner: Learner, prior: Prior, seed: Seed, same_colours: SameColours = ()
) -> Memory:
    """Recalls what a learner believes, with the evidence about each object, so that none is learned from twice.

    Arguments and errors are those of ``Ledger.recall``, whose memory of materials has no objects.
    """
    memory = ledger.recall(learner, prior, seed=seed, same_colours=same_colours)
    if not isinstance(memory, MaterialMemory):
        return memory
    felt = (each for each in recall_felt(ledger, prior, same_colours).values() if each.own.precision.any())
    objects = (HeldObject(each.appearance, tuple(map(memory.colours.index, each.colours)), each.own) for each in felt)
    return replace(memory, objects=tuple(objects))


def _describe_thing(
    name: str, of_object: ObjectSum, trials: Sequence[TrialEvidence], belief: DensityBelief, prior: Prior
) -> KnownThing:
    """Describes a thing: evidence of others about its materials, and its own evidence, counted once."""
    chosen = of_object.materials
    own, shared = of_object.compute_own_likelihood(prior), of_object.compute_likelihood(prior)
    told = shared.embed(chosen, belief.size)
    others = DensityBelief(belief.precision - told.precision, belief.information_vector - told.information_vector)
    before = others.select(chosen).add_object_variation(prior.deviation_sd)
    densities = before.condition(own)
    # The mass is that of the whole, whatever of it was not seen: the body, given what was felt of it.
    geometry = of_object.build_geometry()
    C = geometry.Phi @ before.covariance @ geometry.Phi.T + geometry.compute_covariance(densities.compute_mean())
    H, b = of_object.body.precision, of_object.body.information
    start = geometry.Phi @ before.untruncated_mean
    covariance = np.linalg.solve(np.eye(len(C)) + C @ H, C)
    mass = float((start + covariance @ (b - H @ start))[0])
    medians = tuple(float(each) for each in densities.compute_percentiles([0.5])[0])
    return KnownThing(name, mass, float(np.sqrt(covariance[0, 0])), medians, _describe(trials))


def _describe(trials: Sequence[TrialEvidence]) -> ExperienceSummary:
    return ExperienceSummary(
        len(trials),
        tuple(sorted({trial.robot for trial in trials})),
        min((trial.time for trial in trials), default=""),
    )
