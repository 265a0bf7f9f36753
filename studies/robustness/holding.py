"""Simulations I and II for a sampled setting, with the same Diagram as in the experiments.

The trajectory of a hold depends only on the object and on the densities that are believed by the controller, not on
random draws. Therefore only some observers are simulated, and trajectories of the others are interpolated
(``interpolation.py``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from affordance.arrays import Array
from affordance.belief.material_memory import MaterialMemory
from affordance.experiments import com, weight
from affordance.objects.colour import Colour
from affordance.objects.materials import DENSITIES
from affordance.objects.tool import Tool
from affordance.simulation.trial import get_runner
from affordance.vision.eye import measure_features
from affordance.vision.features import VisionError
from affordance.vision.prediction import predict_object
from studies.robustness.build import HOLD_DURATION, World
from studies.robustness.choosing import Experience
from studies.robustness.interpolation import Motions, interpolate_motions

# Holds are not stiff. An explicit integrator needs half the time, and its trajectories agree to 0.4 um.
_HOLD_SCHEME = "runge_kutta3"
# Variables that are not computed, because no claim depends on them.
_NOT_SIMULATED = ("p_value", "log_evidence", "periods_limited", "periods_failed", "samples_rejected")
_LEFT_OUT = frozenset(
    {
        *_NOT_SIMULATED,
        *("trials_outlier", "height_extreme_grip_m", "height_extreme_com_m", "samples_rejected_test"),
        *("trials_outlier_test", "p_value_test"),
    }
)
# Number of repeated tests of claims with trajectories that are shifted by their error.
_NUM_MOVED = 8

# Function that tests claims about the results of an experiment, and returns the outcomes by name.
type Judge = Callable[[Mapping[str, Any]], Mapping[str, float]]
# Function that computes the results of an experiment from the height of each object's centre over time, (R, N), [m].
type Summarise = Callable[[Sequence[Array]], dict[str, Any]]


class HeldTool(NamedTuple):
    """Object that R observers hold."""

    tool: Tool
    colours: tuple[Colour, ...]  # M colours of the object
    believed: Array  # densities believed by the controller, (R, M), [kg/m^3]
    motions: Motions  # trajectories of all observers


class Held(NamedTuple):
    """Objects of an experiment, held by R observers."""

    numbers: dict[str, Any]  # results on which claims depend
    tools: tuple[HeldTool, ...]  # objects in order of presentation


def measure_rods(world: World, observers: Experience, judge: Judge) -> Held:
    """Computes the results of Simulation I on which claims depend.

    Args:
        world: Objects and settings.
        observers: Memories of each observer before the first rod and after each rod, with the decoy last.
        judge: Function that tests claims.
    """
    beliefs = [[memory.belief for memory in memories] for memories in observers]
    quantiles = [[belief.compute_percentiles(weight.QUARTILES)[:, 0] for belief in each] for each in beliefs]
    modes = [[belief.compute_mode()[0] for belief in each] for each in beliefs]
    known = xr.Dataset(
        {
            "density": (("observer", "moment", "quantile"), np.array(quantiles)),
            "density_mode": (("observer", "moment"), np.array(modes)),
        }
    )

    def summarise(heights: Sequence[Array]) -> dict[str, Any]:
        data = _add_heights(known, {"height": heights})
        return weight.summarise(weight.measure(data), world.rods)

    seen = [_see(world, tool, [each[place] for each in observers]) for place, tool in enumerate(world.rods)]
    return _hold_all(world, world.rods, seen, summarise, judge)


def measure_centre_of_mass(world: World, experience: Experience, judge: Judge) -> Held:
    """Computes the results of Simulation II on which claims depend, for experienced observers."""
    learned, tools = [memories[-1] for memories in experience], world.learning
    seen = [_see(world, tool, learned) for tool in tools]
    medians = np.array([memory.belief.compute_percentiles([0.5])[0] for memory in learned])
    predicted = np.stack([each.predicted for each in seen], axis=1)
    known = xr.Dataset(
        {
            "density_median": (("observer", "colour"), medians),
            "predicted": (("observer", "trial", "parameter"), predicted),
        }
    )

    def summarise(heights: Sequence[Array]) -> dict[str, Any]:
        data = _add_heights(known, dict.fromkeys(com.POINTS, heights))
        return com.summarise(com.measure(data, tools), tools)

    return _hold_all(world, tools, seen, summarise, judge)


def compare_with_simulated(world: World, held: Held) -> float:
    """Simulates all observers, and computes the largest error of their trajectories, [m]."""
    differences = [0.0]
    for each in held.tools:
        believed, places = np.unique(each.believed, axis=0, return_index=True)
        for densities, place in zip(believed, places, strict=True):
            simulated = _hold(world, each.tool, each.colours, densities)
            differences.append(float(np.abs(each.motions.heights[place] - simulated).max()))
    return max(differences)


class _Seen(NamedTuple):
    """Beliefs of R observers about an object before a hold."""

    colours: tuple[Colour, ...]  # M colours of the object
    believed: Array  # densities believed by the controller, (R, M), [kg/m^3]
    predicted: Array  # inertial parameters for these densities, (R, 10)


def _see(world: World, tool: Tool, memories: Sequence[MaterialMemory]) -> _Seen:
    features = measure_features(tool, VisionError(), np.random.default_rng(0))
    beliefs = [predict_object(features, memory, world.settings.prior) for memory in memories]
    believed = np.array([belief.densities.compute_mode() for belief in beliefs])
    predicted = [belief.compute_parameters(rho) for belief, rho in zip(beliefs, believed, strict=True)]
    return _Seen(tuple(beliefs[0].list_colours()), np.maximum(believed, DENSITIES.low), np.array(predicted))


def _add_heights(known: xr.Dataset, heights: Mapping[str, Sequence[Array]]) -> xr.Dataset:
    """Adds heights of each object, (R, N), [m], and NaN for variables that are not simulated."""
    data = known.assign(
        {name: (("observer", "trial", "time"), np.stack(each, axis=1)) for name, each in heights.items()}
    )
    undefined = np.full((data.sizes["observer"], data.sizes["trial"]), np.nan)
    return data.assign(dict.fromkeys(_NOT_SIMULATED, (("observer", "trial"), undefined)))


def _hold_all(world: World, tools: Sequence[Tool], seen: Sequence[_Seen], summarise: Summarise, judge: Judge) -> Held:
    """Computes trajectories of all observers with all objects, without interpolation if its errors affect claims."""

    def compute(heights: Sequence[Array]) -> dict[str, Any]:
        return {name: value for name, value in summarise(heights).items() if name not in _LEFT_OUT}

    def hold(tolerance: float | None) -> Held:
        held = tuple(
            HeldTool(
                tool, each.colours, each.believed, _find_motions(world, tool, each.colours, each.believed, tolerance)
            )
            for tool, each in zip(tools, seen, strict=True)
        )
        return Held(compute([each.motions.heights for each in held]), held)

    held = hold(None)
    errors = [each.motions.error for each in held.tools]
    heights = [each.motions.heights for each in held.tools]
    if any(errors) and any(judge(compute(moved)) != judge(held.numbers) for moved in _move(heights, errors)):
        return hold(0.0)
    return held


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
    """Simulates the height of an object's centre, (N,), [m], given the believed densities, (M,)."""
    memory = MaterialMemory.from_densities(dict(zip(colours, densities.tolist(), strict=True)))
    runner = get_runner(replace(world.settings, integrator=replace(world.settings.integrator, scheme=_HOLD_SCHEME)))
    return runner.run_hold(tool, memory, duration=HOLD_DURATION, seed=(0,)).height_centre


def _move(heights: Sequence[Array], errors: Sequence[float]) -> list[list[Array]]:
    """Shifts the trajectories for each object by their error, upwards, downwards, outwards or inwards at random."""
    rng = np.random.default_rng(0)
    return [
        [
            course + error * rng.choice([-1.0, 1.0]) * (np.sign(course) if rng.random() < 0.5 else 1.0)
            for course, error in zip(heights, errors, strict=True)
        ]
        for _ in range(_NUM_MOVED)
    ]
