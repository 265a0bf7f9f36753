"""Rules that pick the next object to hold."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.choice.hold_worth import Decision, PossibleHold, compute_information
from studies.active.world import Workshop, advise, build_hold_geometry, decide, recall_felt

# Number of samples of a belief, and number of normal points for the closed form.
NUM_SAMPLES = 2000
_POINTS = 2000

# Function that picks one of the remaining candidates.
type Rule = Callable[[Workshop, MaterialMemory, Sequence[str], np.random.Generator], str]


def pick_by_value(workshop: Workshop, memory: MaterialMemory, left: Sequence[str], rng: np.random.Generator) -> str:
    """Picks the object of largest worth by regression, as ``advise_hold`` does; any object held before may be odd."""
    seed = int(rng.integers(2**31))
    felt = recall_felt(workshop, memory)
    return advise(workshop, memory, left, num_samples=NUM_SAMPLES, seed=seed, felt=felt).next_name


def pick_linear(workshop: Workshop, memory: MaterialMemory, left: Sequence[str], rng: np.random.Generator) -> str:
    """Picks the object that would be worth most if beliefs were normal and costs linear in densities."""
    mu, decisions = decide(workshop, memory, NUM_SAMPLES, rng)
    C = np.cov(mu.T)
    z = rng.standard_normal((_POINTS, len(C)))
    worths = {}
    for name in left:
        gain = _find_gain(workshop, memory, name, mu)
        fall = C @ np.linalg.solve(np.eye(len(C)) + gain @ C, gain @ C)
        values, vectors = np.linalg.eigh(0.5 * (fall + fall.T))
        shifts = z @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
        worths[name] = sum(_price_linear(decision, mu, shifts) for decision in decisions)
    return max(left, key=lambda name: worths[name])


def pick_by_information(
    workshop: Workshop, memory: MaterialMemory, left: Sequence[str], rng: np.random.Generator
) -> str:
    """Picks the object that gives the most information about materials."""
    mu = memory.belief.draw_samples(rng, NUM_SAMPLES)
    covariance = np.cov(mu.T)
    found = {}
    for name in left:
        own = mu * (1.0 + workshop.settings.prior.deviation * rng.standard_normal(mu.shape))
        geometry = build_hold_geometry(workshop, name, memory)
        possible = PossibleHold(name, geometry, np.maximum(own, 0.0), np.zeros((len(own), len(geometry.Phi_errors))))
        found[name] = compute_information(possible, workshop.static, workshop.settings.noise, covariance)
    return max(left, key=lambda name: found[name])


def pick_largest(workshop: Workshop, memory: MaterialMemory, left: Sequence[str], rng: np.random.Generator) -> str:
    """Picks the largest object."""
    return max(left, key=lambda name: sum(part.shape.volume for part in workshop.candidates[name].components))


def pick_at_random(workshop: Workshop, memory: MaterialMemory, left: Sequence[str], rng: np.random.Generator) -> str:
    """Picks a random object."""
    return left[int(rng.integers(len(left)))]


RULES: Mapping[str, Rule] = {
    "value": pick_by_value,
    "linear": pick_linear,
    "information": pick_by_information,
    "largest_first": pick_largest,
    "random": pick_at_random,
}


def _find_gain(workshop: Workshop, memory: MaterialMemory, name: str, mu: Array) -> Array:
    """Computes the precision that a hold adds to the materials' means, (M, M)."""
    geometry, noise = build_hold_geometry(workshop, name, memory), workshop.settings.noise
    A, rho = workshop.static.Y @ geometry.Phi, mu.mean(axis=0)
    R = np.diag(noise.compute_sd(workshop.static.tau_arm + A @ rho) ** 2)
    R += workshop.static.Y @ geometry.compute_covariance(rho) @ workshop.static.Y.T
    scaled = workshop.settings.prior.deviation * A * rho
    R += scaled @ scaled.T
    gain: Array = A.T @ np.linalg.solve(R, A)
    return gain


def _price_linear(decision: Decision, mu: Array, shifts: Array) -> float:
    """Computes the worth of shifts of the means, (n, M), if costs were linear in them."""
    cost = decision.charge()
    centred = mu - mu.mean(axis=0)
    sd = np.maximum(centred.std(axis=0), 1e-9)
    slopes = np.linalg.lstsq(centred / sd, (cost - cost.mean(axis=1, keepdims=True)).T, rcond=1e-6)[0].T / sd
    means = cost.mean(axis=1)
    return float(means.min() - (means + shifts @ slopes.T).min(axis=1).mean())
