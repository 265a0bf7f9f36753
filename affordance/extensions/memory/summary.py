"""Summary of a lasting memory: beliefs about materials and objects, and the trials that support them."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.holds import Holds, sum_geometry
from affordance.belief.learner import Seen
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.one_density import OneDensity
from affordance.extensions.memory.ledger import FeltThing, Ledger
from affordance.objects.colour import Colour

_FRACTIONS = (0.05, 0.5, 0.95)
# Step of the central differences for derivatives of the mass, as a fraction of the density.
_STEP = 1e-4


class ExperienceSummary(NamedTuple):
    """Trials that support a belief."""

    trials: int  # number of trials
    robots: tuple[str, ...]
    since: str  # UTC time of the first trial, ISO 8601


class KnownMaterial(NamedTuple):
    """Belief about the mean density of a material, [kg/m^3]."""

    colour: Colour
    median: float
    interval90: tuple[float, float]
    things: tuple[str, ...]  # names of the objects that contain the material
    experience: ExperienceSummary


class KnownThing(NamedTuple):
    """Belief about an object. Objects that look alike are treated as one object."""

    name: str  # all names of the object in trials
    mass: float  # mean, [kg]
    mass_sd: float  # [kg]
    densities: tuple[float, ...]  # median of each material's density, [kg/m^3]
    experience: ExperienceSummary


class MemorySummary(NamedTuple):
    """Materials and objects of a memory, in the order of their first trial."""

    materials: tuple[KnownMaterial, ...]
    things: tuple[KnownThing, ...]


def summarise(ledger: Ledger, prior: Prior) -> MemorySummary:
    """Summarises a memory for a learner with one density per colour; arguments and errors are as in ``recall``."""
    memory, things = ledger.review(prior)
    names = name_things(things)
    with ledger.blame():
        known, colours = memory.belief, memory.colours
        low, median, high = known.compute_percentiles(_FRACTIONS) if colours else np.zeros((3, 0))
        materials = []
        for i, colour in enumerate(colours):
            shown = [number for number, thing in enumerate(memory.things) if i in thing.colours]
            interval = float(low[i]), float(high[i])
            experience = _describe([things[number] for number in shown])
            own_names = tuple(names[number] for number in shown)
            materials.append(KnownMaterial(colour, float(median[i]), interval, own_names, experience))
        return MemorySummary(tuple(materials), _list_things(memory, things, names))


def name_things(things: Sequence[FeltThing]) -> list[str]:
    """Joins all names of each object in trials, and numbers objects with equal names."""
    names: list[str] = []
    for thing in things:
        joined = ", ".join(thing.names)
        numbered = (f"{joined} #{number}" for number in itertools.count(2))
        names.append(next(each for each in itertools.chain([joined], numbered) if each not in names))
    return names


def _list_things(memory: MaterialMemory, things: Sequence[FeltThing], names: Sequence[str]) -> tuple[KnownThing, ...]:
    """Summarises the objects that were felt.

    The mass includes the estimated errors of the geometry, for example of an unseen part. Given the densities, these
    errors are normally distributed with a mean that depends on the densities.
    """
    if not things:
        return ()
    assert isinstance(memory.learner, OneDensity)
    _, posterior = memory.learner.infer(memory.state, Seen((), np.arange(len(things))))
    assert posterior.own is not None
    own, holds = posterior.own, Holds.of(memory.state)
    T, C = own.mean.shape
    Q = holds.errors.shape[2]
    volumes, changes = np.zeros((T, C)), np.zeros((T, Q, C))
    for number, thing in enumerate(things):
        volume = thing.geometry.Phi[0]
        volumes[number, : len(volume)] = volume
        changes[number, : len(thing.geometry.Phi_errors), : len(volume)] = thing.geometry.Phi_errors[:, 0]
    # Posterior means, followed by one step along each density in both directions, (1 + 2 C, T, C).
    step = _STEP * np.maximum(np.abs(own.mean), 1.0)
    rho = own.mean + np.concatenate([np.zeros((1, C)), np.eye(C), -np.eye(C)])[:, None] * step
    M, b, *_ = sum_geometry(holds, rho[None])
    change = (changes @ rho[..., None])[..., 0]  # change in mass per error, (1 + 2 C, T, Q)
    masses = (volumes * rho).sum(axis=-1) + (change * np.linalg.solve(M[0], b[0, ..., None])[..., 0]).sum(axis=-1)
    slopes = (masses[1 : C + 1] - masses[C + 1 :]).T / (2.0 * step)
    variances = ((slopes[:, None] @ own.covariance)[:, 0] * slopes).sum(axis=-1)
    variances += (change[0] * np.linalg.solve(M[0, 0], change[0, ..., None])[..., 0]).sum(axis=-1)
    is_felt = np.isin(np.arange(T), holds.thing[0][holds.regressor[0].any(axis=(1, 2))])
    found = []
    for k in np.flatnonzero(is_felt).tolist():
        densities = DensityBelief.from_normals(own.take([k]).select(range(len(memory.things[k].colours))))
        medians = tuple(float(each) for each in densities.compute_percentiles([0.5])[0])
        mass, mass_sd = float(masses[0, k]), float(np.sqrt(variances[k]))
        found.append(KnownThing(names[k], mass, mass_sd, medians, _describe([things[k]])))
    return tuple(found)


def _describe(things: Sequence[FeltThing]) -> ExperienceSummary:
    return ExperienceSummary(
        sum(thing.trials for thing in things),
        tuple(sorted({robot for thing in things for robot in thing.robots})),
        min((thing.since for thing in things), default=""),
    )
