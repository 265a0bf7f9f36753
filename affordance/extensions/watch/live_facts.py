"""Texts and charts that ``affordance watch`` shows next to the scene."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtr

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.choice.pricing import Amount
from affordance.objects.colour import Colour
from affordance.objects.tool import Tool
from affordance.reporting.formatting import format_number
from affordance.simulation.trial_record import TrialRecord

# Largest density in charts, [kg/m^3]. Lead, the densest material, is below it.
_DENSITY_MAX = 14000.0
_FRACTIONS = ndtr(np.linspace(-3.0, 3.0, 50))
# Kernel density estimate of a mass: number of samples, number of points, and bandwidth in standard deviations.
_NUM_SAMPLES, _NUM_POINTS, _WIDTH = 512, 80, 0.2
# Largest p-value of a hold that is called somewhat surprising.
_UNLIKELY = 0.05
_LIGHT = 0.1  # [kg]
_GREY, _BLUE, _BLACK = "#aaaaaa", "#1f5fa8", "#222222"


def draw_masses(belief: ObjectBelief) -> Array:
    """Samples the belief about an object's mass, (S,), [kg], with a fixed seed."""
    rng = np.random.default_rng(0)
    rho = belief.densities.draw_samples(rng, _NUM_SAMPLES, is_even=True)
    errors = rng.standard_normal((_NUM_SAMPLES, len(belief.geometry.Phi_errors)))
    masses: Array = belief.geometry.compute_parameters(rho, errors)[:, 0]
    return masses


def describe_mass(mass: float, unit: str = " kg", like: float | None = None) -> str:
    """Formats a mass, [kg], with two decimals.

    It has three decimals if ``like``, the mass for comparison (by default the mass itself), is below 0.1 kg.
    """
    return f"{mass:.{2 if (mass if like is None else like) >= _LIGHT else 3}f}{unit}"


def describe_masses(masses: Array, truth: float) -> str:
    """Formats mean and 90 % interval of a belief about a mass from its samples, (S,), [kg]."""
    mean, low, high = (describe_mass(each, "", truth) for each in Amount.of(masses))
    return f"{mean} kg ({low} to {high})"


def describe_motion(record: TrialRecord) -> str:
    """Describes how far the object moved from its target position."""
    farthest = 100.0 * max(record.height_centre, key=abs)
    text = f"{abs(farthest):.1f} cm {'down' if farthest < 0.0 else 'up'}"
    weak = f"; {', '.join(record.overloaded)} cannot hold it" if record.overloaded else ""
    return text + weak


def describe_surprise(record: TrialRecord, *, learns_from_outliers: bool) -> str:
    """Describes how surprising a hold was, given its p-value under the previous belief."""
    if record.is_outlier:
        return f"yes, beyond five sigma{'' if learns_from_outliers else ': nothing is learned'}"
    p = format_number(record.p_value, 2)
    return f"{'somewhat' if record.p_value < _UNLIKELY else 'no'} (p = {p})"


def describe_grip(costs: Mapping[str, float], chosen: str, unit: str) -> str:
    """Compares the chosen grip with the cheapest grip, given each grip's cost at the true densities.

    Infeasible grips have infinite costs.
    """
    verdict = "right" if costs[chosen] <= min(costs.values()) else "wrong"
    order = [chosen, *(grip for grip in costs if grip != chosen)]
    amounts = [f"{costs[grip]:.1f} {unit}" if np.isfinite(costs[grip]) else "it cannot be done" for grip in order]
    parts = [f"by {grip.replace('_', ' ')} {amount}" for grip, amount in zip(order, amounts, strict=True)]
    return f"{verdict}: {', '.join(parts)}"


def describe_memory(memory: MaterialMemory, names: Mapping[Colour, str]) -> list[tuple[str, str]]:
    """Lists the colours of a memory in hexadecimal, and the quartiles of their densities as text."""
    if not memory.colours:
        return []
    lows, highs = memory.belief.compute_percentiles([0.25, 0.75]) / 1000.0
    return [
        (show_colour(colour), f"{names.get(colour, 'unnamed')}, by all holds: {low:.1f} to {high:.1f}")
        for colour, low, high in zip(memory.colours, lows, highs, strict=True)
    ]


def draw_mass_chart(tool: Tool, expected: Array | None, felt: Array | None) -> dict[str, Any]:
    """Builds a chart of the prior and posterior of a tool's mass from samples, (S,) each, if there are any."""
    most = 1.3 * max([tool.mass] + ([] if expected is None else [float(np.quantile(expected, 0.98))]))
    curves = [(each, colour) for each, colour in ((expected, _GREY), (felt, _BLUE)) if each is not None]
    return _build_chart(
        most,
        [(_trace_masses(each), colour, colour == _GREY) for each, colour in curves],
        [(tool.mass, _BLACK)],
    )


def draw_density_chart(tool: Tool, expected: ObjectBelief | None, felt: ObjectBelief | None) -> dict[str, Any]:
    """Builds a chart of the prior and posterior of a tool's densities, if there are any."""
    truths = [(part.material.density / 1000.0, part.looks_like.colour) for part in tool.components]
    curves = [
        (curve / [1000.0, 1.0], show_colour(colour, 1.0 if belief is expected else 0.6), belief is expected)
        for belief in (expected, felt)
        if belief is not None
        for colour, curve in zip(belief.list_colours(), trace_densities(belief.densities), strict=True)
    ]
    most = 1.1 * max([density for density, _ in truths] + [curve[-1, 0] for curve, _, _ in curves if len(curve)])
    return _build_chart(
        min(most, _DENSITY_MAX / 1000.0), curves, [(each, show_colour(colour, 0.6)) for each, colour in truths]
    )


def trace_densities(belief: DensityBelief) -> list[Array]:
    """Computes the marginal distribution of each density as a curve, (N, 2).

    Columns are the density, [kg/m^3], and the probability density relative to its maximum.
    """
    if not belief.size:
        return []
    curves = []
    for values in belief.compute_percentiles(list(_FRACTIONS)).T:
        heights = np.diff(_FRACTIONS) / np.maximum(np.diff(values), 1e-9)
        curve = np.column_stack([0.5 * (values[1:] + values[:-1]), heights / heights.max()])
        curves.append(curve[curve[:, 0] <= _DENSITY_MAX])
    return curves


def show_colour(colour: Colour, brightness: float = 1.0) -> str:
    """Formats a colour in hexadecimal, darkened by a factor."""
    return "#" + "".join(f"{round(255 * brightness * min(max(each, 0.0), 1.0)):02x}" for each in colour)


def _trace_masses(masses: Array) -> Array:
    """Estimates the distribution of sampled masses, (S,), as a curve, (N, 2).

    Columns are the mass, [kg], and the probability density relative to its maximum.
    """
    width = max(_WIDTH * float(masses.std()), 1e-6)
    at = np.linspace(max(0.0, masses.min() - 3.0 * width), masses.max() + 3.0 * width, _NUM_POINTS)
    heights = np.exp(-0.5 * ((at[:, None] - masses) / width) ** 2).sum(axis=1)
    return np.column_stack([at, heights / heights.max()])


def _build_chart(
    most: float, curves: Sequence[tuple[Array, str, bool]], truths: Sequence[tuple[float, str]]
) -> dict[str, Any]:
    """Builds a chart with an axis from 0 to ``most``.

    Args:
        most: End of the axis.
        curves: Points (N, 2) of each curve, its colour, and True to fill it.
        truths: True values and their colours.
    """
    step = max(each for each in (*(m * 10.0**k for k in range(-4, 3) for m in (1, 2, 5)),) if each <= most / 3.0)
    return {
        "curves": [
            (np.round(curve[curve[:, 0] <= most] / [most, 1.0], 4).tolist(), colour, is_filled)
            for curve, colour, is_filled in curves
        ],
        "truths": [(value / most, colour) for value, colour in truths],
        "ticks": [(value / most, f"{value:g}") for value in np.arange(0.0, most, step).round(6).tolist()],
    }
