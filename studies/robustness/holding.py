"""Simulations I and II under a setting, in the Diagram of all simulations.

Where a hold goes depends on the object and on the density that control believes, and on nothing that is drawn: with
what is believed of one material, holds at a few densities between the least and the largest one say all of them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.experience import Experience, ExperienceConfig
from affordance.experiments.shared.presented import QUARTILES
from affordance.objects.tool import Tool
from affordance.reporting import statistics
from affordance.settings import Settings
from affordance.simulation.trial import get_runner
from affordance.vision.features import VisionError, measure_features
from affordance.vision.visual_prior import predict_object
from studies.robustness.build import HOLD_DURATION, World

# Holds are not stiff: by the explicit scheme they take half as long and go the same way to 0.1 um.
_HOLD_SCHEME = "runge_kutta3"
# Holds between which heights are interpolated, by object in the order of presentation: the first is held with the
# prior, the second with what one trial has taught, from the least to the largest; later ones with ever less spread.
_NUM_NODES = (1, 3, 2, 2, 1)


def measure_rods(world: World, observers: Sequence[Sequence[Memory]]) -> dict[str, Any]:
    """The numbers of Simulation I that claims are about.

    Args:
        world: Gives rods and settings.
        observers: The memories of each observer, before the first and after each honest object.
    """
    *honest, _ = world.rods
    modes = np.array([[memory.belief.compute_mode()[0] for memory in memories] for memories in observers])
    percentiles = [[memory.belief.compute_percentiles(QUARTILES)[:, 0] for memory in each] for each in observers]
    quartiles = np.median(percentiles, axis=0)
    extremes = [
        _interpolate(world, tool, modes[:, trial], _NUM_NODES[trial]) for trial, tool in enumerate(world.rods)
    ]
    lowest, highest = np.moveaxis(np.array(extremes), 0, -1)  # (observers, objects) each
    deviation = np.maximum(np.abs(lowest), highest)
    return {
        "density_true": world.rods[0].components[0].material.density,
        "density_p25": quartiles[:, 0],
        "density_median": quartiles[:, 1],
        "density_p75": quartiles[:, 2],
        "density_mode": np.median(modes, axis=0),
        "drop_m": -lowest[:, :-1].mean(axis=0),
        "deviation_m": deviation[:, :-1].mean(axis=0),
        "mass_true": [tool.mass for tool in honest],
        "decoy_lift_m": highest[:, -1].mean(),
        "decoy_rises": (highest[:, -1] > -lowest[:, -1]).mean(),
    }


def measure_centre_of_mass(
    world: World, config: ExperienceConfig, experience: Experience, count: int
) -> dict[str, Any]:
    """The numbers of Simulation II, its test pass by the first ``count`` observers."""
    experiment = load_hold_experiment("com", seed=config.seed)
    experiment = experiment.with_tools(world.learning, experiment.objects.groups).with_settings(_hold_settings(world))
    runs = [experiment.run_observer(None, experience, repeat) for repeat in range(count)]
    arrays = {name: np.stack([run[name] for run in runs]) for name in runs[0]}
    # What is predicted needs no hold: of all observers.
    predicted = []
    for repeat in range(experience.num_repeats):
        memory = experience.recall(repeat, experience.num_trials)
        for tool in experiment.tools:
            features = measure_features(tool, VisionError(), np.random.default_rng(0))
            belief = predict_object(features, memory, world.settings.prior)
            predicted.append(belief.compute_parameters(belief.densities.compute_mode()))
    arrays["parameters_predicted"] = np.reshape(predicted, (experience.num_repeats, len(experiment.tools), -1))
    return experiment.compute_metrics(None, experience, arrays)


def _hold_settings(world: World) -> Settings:
    return replace(world.settings, integration_scheme=_HOLD_SCHEME)


def _interpolate(world: World, tool: Tool, believed: Array, num_nodes: int) -> tuple[Array, Array]:
    """Lowest and highest place of a rod, held by those who believe some densities, both (observers,), [m].

    Args:
        world: Gives the settings.
        tool: The rod.
        believed: Densities that control uses, (observers,), [kg/m^3].
        num_nodes: At how many of them the hold is simulated.
    """
    nodes = np.unique(np.quantile(believed, np.linspace(0.0, 1.0, num_nodes)))
    runner, (part, *_) = get_runner(_hold_settings(world)), tool.components
    heights = []
    for density in nodes:
        memory = MaterialMemory.from_densities({part.looks_like.colour: float(density)})
        heights.append(runner.run_hold(tool, memory, duration=HOLD_DURATION, seed=(0,)).height_centre)
    lowest, highest = -statistics.compute_drop(np.array(heights)), statistics.compute_lift(np.array(heights))
    places = np.log(believed), np.log(nodes)
    return np.interp(*places, lowest), np.interp(*places, highest)
