"""Simulations I and II under a setting, in the Diagram of all simulations, their numbers as their protocols say.

Where a hold goes depends on the object and on the densities that control believes, and on nothing that is drawn: of
many observers some are simulated, and the motions of the others are interpolated (``interpolation.py``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from affordance.arrays import Array, Arrays
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import Memory
from affordance.experiments.protocol_runs import load_hold_experiment
from affordance.experiments.shared.experience import Experience
from affordance.experiments.shared.presented import QUARTILES, PresentationExperiment
from affordance.experiments.shared.recall import recall
from affordance.objects.colour import Colour
from affordance.objects.materials import DENSITIES
from affordance.objects.tool import Tool
from affordance.protocols.measured import compute_numbers
from affordance.protocols.number_entries import Measure
from affordance.simulation.trial import get_runner
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.systems import predict_object
from studies.robustness.build import HOLD_DURATION, World
from studies.robustness.interpolation import Motions, interpolate_motions

# Holds are not stiff: by the explicit scheme they take half as long and go the same way to 0.4 um.
_HOLD_SCHEME = "runge_kutta3"
# Measures that neither beliefs nor the height of an object's centre give; no claim is about them.
_LEFT_OUT = frozenset(
    {
        *(Measure.EXCURSION_GRIP, Measure.EXCURSION_CENTRE_OF_MASS, Measure.LOG_EVIDENCE, Measure.P_VALUE),
        *(Measure.OUTLIER, Measure.PERIODS_LIMITED, Measure.PERIODS_FAILED, Measure.SAMPLES_REJECTED),
    }
)
# How often numbers are judged again with motions moved by their error.
_NUM_MOVED = 8

# Judges the claims about numbers: what claims hold, by name.
type Judge = Callable[[Mapping[str, Any]], Mapping[str, float]]


class HeldTool(NamedTuple):
    """An object that R observers hold."""

    tool: Tool  # the object
    colours: tuple[Colour, ...]  # colours of the objects, M of them
    believed: Array  # densities that control uses, (R, M), [kg/m^3]
    motions: Motions  # motions of all


class Held(NamedTuple):
    """Objects of a protocol, held by R observers."""

    numbers: dict[str, Any]  # numbers of the protocol that claims are about
    tools: tuple[HeldTool, ...]  # objects in the order of presentation


def measure_rods(world: World, observers: Sequence[Sequence[Memory]], judge: Judge) -> Held:
    """The numbers of Simulation I that claims are about.

    Each observer has memories before the first and after each rod, the decoy the last.
    """
    beliefs = [[memory.belief for memory in memories] for memories in observers]
    arrays = {
        "density_quantiles": np.array(
            [[belief.compute_percentiles(QUARTILES)[:, 0] for belief in each] for each in beliefs]
        ),
        "density_mode": np.array([[belief.compute_mode()[0] for belief in each] for each in beliefs]),
    }
    return _measure(world, "weight", world.rods, [memories[:-1] for memories in observers], arrays, judge)


def measure_centre_of_mass(world: World, experience: Experience, judge: Judge) -> Held:
    """The numbers of Simulation II that claims are about; arguments are those of ``measure_rods``."""
    learned = [recall(experience, repeat, experience.num_trials) for repeat in range(experience.num_repeats)]
    densities = np.array([memory.belief.compute_percentiles(QUARTILES) for memory in learned])
    memories = [[memory] * len(world.learning) for memory in learned]
    return _measure(world, "com", world.learning, memories, {"densities": densities}, judge)


def compare_with_simulated(world: World, held: Held) -> float:
    """Largest difference of all motions, at any time, to those simulated of every observer, [m]."""
    differences = [0.0]
    for each in held.tools:
        believed, places = np.unique(each.believed, axis=0, return_index=True)
        for densities, place in zip(believed, places, strict=True):
            simulated = _hold(world, each.tool, each.colours, densities)
            differences.append(float(np.abs(each.motions.heights[place] - simulated).max()))
    return max(differences)


def _measure(
    world: World, name: str, tools: Sequence[Tool], memories: Sequence[Sequence[Memory]], arrays: Arrays, judge: Judge
) -> Held:
    """Holds the objects of a protocol, each by those who have the memories of its column, (R, K)."""
    found = [_see(world, tool, [each[place] for each in memories]) for place, tool in enumerate(tools)]
    known = {
        **arrays,
        "presented": np.tile(np.arange(len(tools)), (len(memories), 1)),
        "parameters_predicted": np.stack([predicted for _, _, predicted in found], axis=1),
        "parameters_true": np.tile([tool.parameters for tool in tools], (len(memories), 1, 1)),
    }
    experiment = load_hold_experiment(name)
    experiment = replace(experiment, objects=experiment.objects._replace(tools=tuple(tools)))

    def hold(tolerance: float | None) -> Held:
        held = tuple(
            HeldTool(tool, colours, believed, _find_motions(world, tool, colours, believed, tolerance))
            for tool, (colours, believed, _) in zip(tools, found, strict=True)
        )
        return Held(_compute(experiment, known, [each.motions.heights for each in held]), held)

    held = hold(None)
    errors = [each.motions.error for each in held.tools]
    heights = [each.motions.heights for each in held.tools]
    if any(errors) and any(
        judge(_compute(experiment, known, moved)) != judge(held.numbers) for moved in _move(heights, errors)
    ):
        return hold(0.0)
    return held


def _see(world: World, tool: Tool, memories: Sequence[Memory]) -> tuple[tuple[Colour, ...], Array, Array]:
    """Colours of an object, densities believed of them, (R, M), and the parameters that follow, (R, 10)."""
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    beliefs = [predict_object(features, memory, world.settings.prior) for memory in memories]
    believed = np.array([belief.densities.compute_mode() for belief in beliefs])
    predicted = [belief.compute_parameters(rho) for belief, rho in zip(beliefs, believed, strict=True)]
    return beliefs[0].memory.colours, np.maximum(believed, DENSITIES.low), np.array(predicted)


def _find_motions(
    world: World, tool: Tool, colours: tuple[Colour, ...], believed: Array, tolerance: float | None
) -> Motions:
    honest = all(part.material == part.looks_like for part in tool.components)
    densities = {part.looks_like.colour: part.material.density for part in tool.components}
    return interpolate_motions(
        lambda rho: _hold(world, tool, colours, rho),
        believed,
        np.array([densities[colour] for colour in colours]) if honest else None,
        **({} if tolerance is None else {"tolerance": tolerance}),
    )


def _hold(world: World, tool: Tool, colours: tuple[Colour, ...], densities: Array) -> Array:
    """Height of an object's centre, (N,), [m], held by one who believes densities, (M,)."""
    memory = MaterialMemory.from_densities(dict(zip(colours, densities.tolist(), strict=True)))
    runner = get_runner(replace(world.settings, integrator=replace(world.settings.integrator, scheme=_HOLD_SCHEME)))
    return runner.run_hold(tool, memory, duration=HOLD_DURATION, seed=(0,)).height_centre


def _compute(experiment: PresentationExperiment, arrays: Arrays, heights: Sequence[Array]) -> dict[str, Any]:
    """The numbers of the protocol, of heights (R, N) of each object."""
    entries = {name: entry for name, entry in experiment.numbers.items() if entry.measure not in _LEFT_OUT}
    return compute_numbers(entries, experiment.measure({**arrays, "height_centre": np.stack(heights, axis=1)}))


def _move(heights: Sequence[Array], errors: Sequence[float]) -> list[list[Array]]:
    """Motions moved by their errors, up or down, or out or in, object by object."""
    rng = np.random.default_rng(0)
    return [
        [
            course + error * rng.choice([-1.0, 1.0]) * (np.sign(course) if rng.random() < 0.5 else 1.0)
            for course, error in zip(heights, errors, strict=True)
        ]
        for _ in range(_NUM_MOVED)
    ]
