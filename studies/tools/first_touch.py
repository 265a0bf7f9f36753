"""Predicts the mass of a tool that was never held, from experience with tools made of the same materials.

Four measures compare predicted masses m with true masses M, as is usual for masses predicted from pictures (Standley,
Sener, Chen and Savarese 2017, image2mass, CoRL): the means of |m - M|, of |ln m / M|, of |m - M| / M, and of
min(m / M, M / m).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.proprioception.estimator import TorqueStatistics
from affordance.settings import DEFAULT_SETTINGS, Settings
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import predict_object
from studies.tools.holds import learn

type Features = Mapping[str, Sequence[ComponentFeatures]]
type Felt = Mapping[str, Sequence[TorqueStatistics]]

# Number of belief samples from which medians and intervals are computed.
_NUM_SAMPLES = 4000
# Ends of the 90 % intervals, and the median, [%].
_PERCENTILES = (5.0, 50.0, 95.0)
# A tool can be left out if recurring materials make up at least this fraction of its mass. A material recurs if it
# makes up at least this fraction of another tool's mass; if it makes up less, holding that tool teaches nothing.
_MIN_KNOWN, _MIN_RECURRING = 0.9, 0.1
# Colour of every part for an observer that sees no colours.
_ONE_COLOUR: Colour = (0.5, 0.5, 0.5)
STEEL, WATER = 7850.0, 1000.0


class Prediction(NamedTuple):
    """Belief about a tool before it is touched, at the percentiles _PERCENTILES."""

    mass: Array  # percentiles of the mass, shape (3,), [kg]
    com: Array  # percentiles of the centre of mass in the hand, shape (3, 3): percentiles times coordinates, [m]


class Truth(NamedTuple):
    """True mass, [kg], and centre of mass in the hand, shape (3,), [m]."""

    mass: float
    com: Array


class Score(NamedTuple):
    """Four measures of error, and the coverage of 90 % intervals."""

    ade_g: float  # mean absolute error, [g]
    alde: float  # mean absolute error of the logarithm
    ape: float  # mean absolute error as a fraction of the true mass
    mnre: float  # mean ratio of the smaller to the larger of predicted and true mass
    coverage_mass: float  # coverage of the intervals of mass
    coverage_com: float  # coverage of the intervals of the centre of mass's coordinates


def predict(
    features: Sequence[ComponentFeatures], memory: MaterialMemory, settings: Settings, rng: np.random.Generator
) -> Prediction:
    """Predicts mass and centre of mass from the belief about materials."""
    pi = predict_object(features, memory, settings.prior).draw_parameters(rng, _NUM_SAMPLES)
    return Prediction(
        np.percentile(pi[:, 0], _PERCENTILES), np.percentile(pi[:, 1:4] / pi[:, :1], _PERCENTILES, axis=0)
    )


def score(predictions: Sequence[Prediction], truths: Sequence[Truth]) -> Score:
    """Compares predictions with the truth."""
    m, M = np.array([each.mass[1] for each in predictions]), np.array([each.mass for each in truths])
    within = [(p.mass[0] <= t.mass <= p.mass[2]) for p, t in zip(predictions, truths, strict=True)]
    held = [(p.com[0] <= t.com) & (t.com <= p.com[2]) for p, t in zip(predictions, truths, strict=True)]
    logs = np.abs(np.log(m / M))
    return Score(
        float(1e3 * np.abs(m - M).mean()),
        float(logs.mean()),
        float((np.abs(m - M) / M).mean()),
        float(np.exp(-logs).mean()),
        float(np.mean(within)),
        float(np.mean(held)),
    )


def predict_unfelt(
    names: Sequence[str], felt: Felt, features: Features, colours: Sequence[Colour], settings: Settings, seed: int
) -> dict[str, Prediction]:
    """Predicts each tool from experience with all other tools that were held."""
    return {
        name: predict(
            features[name],
            learn({other: holds for other, holds in felt.items() if other != name}, features, colours, settings),
            settings,
            np.random.default_rng([seed, *name.encode()]),
        )
        for name in names
    }


def take_first(felt: Felt, count: int) -> dict[str, Sequence[TorqueStatistics]]:
    """Selects the first holds of each tool."""
    return {name: holds[:count] for name, holds in felt.items()}


def make_all_alike(features: Features) -> dict[str, list[ComponentFeatures]]:
    """Gives every part of every tool the same colour, as for an observer that assumes a single density."""
    return {
        name: [replace(part, colour=_ONE_COLOUR, colour_sd=0.0) for part in parts] for name, parts in features.items()
    }


def predict_without_experience(
    features: Sequence[ComponentFeatures], density: float, prior: Prior = DEFAULT_SETTINGS.prior
) -> Prediction:
    """Computes mass and centre of mass if everything had one density, [kg/m^3]."""
    memory = MaterialMemory.from_densities({_ONE_COLOUR: density})
    alike = make_all_alike({"": features})[""]
    belief = predict_object(alike, memory, replace(prior, deviation=1e-3))
    pi = belief.compute_parameters(belief.densities.compute_mean())
    return Prediction(np.full(3, pi[0]), np.tile(pi[1:4] / pi[0], (3, 1)))


def list_recurring(tools: Mapping[str, Tool]) -> tuple[str, ...]:
    """Lists the tools that consist mostly of materials recurring in other tools, from which these can be learned."""
    shares = {name: compute_shares(tool) for name, tool in tools.items()}
    recurring = []
    for name, own in shares.items():
        taught = {
            material
            for other, parts in shares.items()
            if other != name
            for material, share in parts.items()
            if share >= _MIN_RECURRING
        }
        if sum(share for material, share in own.items() if material in taught) >= _MIN_KNOWN:
            recurring.append(name)
    return tuple(recurring)


def compute_shares(tool: Tool) -> dict[str, float]:
    """Computes the fraction of a tool's mass that each of its materials makes up, by name."""
    masses: dict[str, float] = {}
    for part in tool.components:
        masses[part.material.name] = masses.get(part.material.name, 0.0) + part.material.density * part.shape.volume
    return {name: mass / sum(masses.values()) for name, mass in masses.items()}
