"""Measures the coverage of intervals if the truth is drawn from the prior.

Bodies drawn from the prior, and seen objects with an unseen lump, are held in windows of the Panda's motion. Gains,
friction and errors are drawn from the likelihood, so only the posterior is tested.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tqdm import tqdm

from affordance.arrays import Array, Mask
from affordance.belief.density_belief import Prior
from affordance.belief.felt_object import AtHand, Thing
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.identification.evidence.joint_statistics import ChannelSamples, compute_statistics
from affordance.identification.evidence.payload_likelihood import ChannelPrior, PayloadLikelihood
from affordance.identification.posterior.body_posterior import WeightedBodies, draw_bodies, find_mode
from affordance.identification.posterior.marginals import describe_bodies, summarise
from affordance.identification.posterior.part_posterior import SeenObject, infer_parts
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.recording.preparation import PreparedRun
from affordance.identification.settings import IdentificationSettings, SignalKind
from affordance.objects.inertia import Geometry, compute_point_parameters
from affordance.plant.serial_chain import SerialChain
from studies.recorded.random_payloads import RandomPayload, draw_payload
from studies.recorded.solids import CLASSES

_LENGTH = 5.0  # [s]
_MASSES = (0.1, 3.0)
# Prior of materials that were never held, with the default in settings.py.
MATERIAL_PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)


@dataclass(frozen=True)
class World:
    """Arm and motion for holding bodies."""

    robot: SerialChain
    prepared: PreparedRun
    variance: Array  # long-run variance of each joint's errors
    settings: IdentificationSettings

    def hold(self, pi: Array, rng: np.random.Generator) -> PayloadLikelihood:
        """Simulates a hold of a body through a random window; returns its likelihood."""
        n = self.robot.num_joints
        rows = round(_LENGTH * self.prepared.rate)
        first = int(rng.integers(len(self.prepared.times) - rows))
        part = self.prepared.select(slice(first, first + rows))
        prior = self.settings.get_prior(SignalKind.JOINT_TORQUE)
        Y = self.robot.compute_payload_regressors(part.q, part.v, part.vdot)
        direction = np.sign(part.v)
        gain_sd = float(np.hypot(prior.scale_own_sd, prior.drift_own_sd))
        gain = 1.0 + gain_sd * rng.standard_normal(n)
        c = prior.friction_sd * rng.standard_normal((3, n))
        error = np.sqrt(self.variance) * rng.standard_normal((rows, n))
        signal = gain * (Y @ pi) + c[0] * direction + c[1] * part.v + c[2] + error
        zero = np.zeros_like(signal)
        used = np.abs(part.v) >= self.settings.min_speed
        samples = ChannelSamples(Y, zero, zero, direction, part.v, signal, used)
        known = ChannelPrior(
            np.tile([1.0, 0.0], (n, 1)),
            np.tile(np.diag([gain_sd**2, 0.0]), (n, 1, 1)),
            np.zeros((n, 3)),
            np.full((n, 3), prior.friction_sd),
        )
        return PayloadLikelihood(compute_statistics(samples, rows), known, self.variance)


def measure_coverage(world: World, *, num_draws: int, seed: int) -> dict[str, Any]:
    """Measures the coverage of 90 % intervals for bodies of each kind; the keys are as in metrics.json."""
    solid = SolidPrior.for_hand()
    rng = np.random.default_rng((seed, 1))
    coverage = _cover(world, lambda rng: solid.draw_parameters(rng, 1)[0], rng, num_draws, "own prior")
    rng = np.random.default_rng((seed, 2))
    hidden = [
        _hide_and_find(world, rng) for _ in tqdm(range(num_draws), desc="hidden part", unit="object", disable=None)
    ]
    return {
        "prior_coverage": {
            "mass": coverage[0],
            "com": coverage[1:4].mean(),
            "inertia": coverage[4:7].mean(),
        },
        "hidden_part_com_coverage": float(np.mean(hidden)),
    }


def measure_class_coverage(world: World, *, num_draws: int, seed: int) -> dict[str, Any]:
    """Measures the coverage of 90 % intervals for each class of objects, the lowest over coordinates and moments.

    Returns:
        Values as in metrics.json: coverage for each class, and of each quantity for all classes in order.
    """
    found = {}
    for number, (name, draw) in enumerate(CLASSES.items()):
        coverage = _cover(world, draw, np.random.default_rng((seed, 3, number)), num_draws, name)
        found[name] = {"mass": coverage[0], "com": coverage[1:4].min(), "inertia": coverage[4:7].min()}
    quantities = ("mass", "com", "inertia")
    return {"solid_coverage": found, "class_coverage": {q: [each[q] for each in found.values()] for q in quantities}}


def _cover(
    world: World, draw: Callable[[np.random.Generator], Array], rng: np.random.Generator, num_draws: int, name: str
) -> Array:
    """Computes how often intervals contain the mass, centre and moments of drawn bodies, (7,)."""
    solid, inside = SolidPrior.for_hand(), []
    for _ in tqdm(range(num_draws), desc=name, unit="body", disable=None):
        pi = draw(rng)
        likelihood = world.hold(pi, rng)
        bodies = draw_bodies(likelihood, solid, find_mode(likelihood, solid), rng, world.settings.num_samples)
        inside.append(_find_inside(bodies, pi))
    coverage: Array = np.mean(inside, axis=0)
    return coverage


def _hide_and_find(world: World, rng: np.random.Generator) -> float:
    """Computes the coverage of the centre of mass if a fifth of the mass is in an unseen lump."""
    seen = draw_payload(rng, _MASSES)
    share = world.settings.unseen_share
    lump = compute_point_parameters(rng.uniform(seen.low, seen.high))
    pi = (1.0 - share) * seen.parameters + share * seen.parameters[0] * lump
    parts = infer_parts(
        world.hold(pi, rng),
        _see(seen).place(np.eye(4)),
        deviation=MATERIAL_PRIOR.deviation,
        unseen_share=share,
        rng=rng,
        num_samples=world.settings.num_samples,
    )
    return float(np.mean(_find_inside(parts.bodies, pi)[1:4]))


def _see(payload: RandomPayload) -> SeenObject:
    """Returns what a camera sees: the geometry, with a separate, unknown material for each part."""
    num_parts = payload.Phi.shape[1]
    colours = [(i / num_parts, 0.2, 0.5) for i in range(num_parts)]
    thing = AtHand(Thing((), tuple(range(num_parts))), 0)
    memory = replace(MaterialMemory().add_colours(colours, MATERIAL_PRIOR), at_hand=thing)
    densities = memory.belief.add_object_variation(MATERIAL_PRIOR.deviation)
    geometry = Geometry(payload.Phi, np.zeros((0, 10, num_parts)))
    return SeenObject(ObjectBelief(memory, densities, geometry), (), payload.low, payload.high)


def _find_inside(bodies: WeightedBodies, pi: Array) -> Mask:
    marginals = summarise(describe_bodies(bodies.pi), bodies.weights)
    truth = describe_bodies(pi[None])[0]
    inside: Mask = (marginals.low90 <= truth) & (truth <= marginals.high90)
    return inside
