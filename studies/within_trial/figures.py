"""Figures of a single trial: the posterior as it narrows, and the arm as it sinks and recovers."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from affordance.arrays import Array
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from affordance.reporting.formatting import label

_METRES_TO_CM = 100.0


class Growth(NamedTuple):
    """Belief about a density within a trial, at N times; each entry conditions on the samples up to its time."""

    times: Array  # times, (N,), [s]
    quartiles: Array  # 25th, 50th and 75th percentile of the density, (N, 3), [kg/m^3]
    # Standard deviation of the normal distribution before it is restricted to positive values, (N,), [kg/m^3].
    sd: Array
    sd_at_rest: Array  # theoretical standard deviation for an arm at rest in its final posture, (N,), [kg/m^3]


class Sinking(NamedTuple):
    """Height of an object, and the density that control assumes."""

    times: Array  # times, (N,), [s]
    height: Array  # height of the object's centre relative to where it was given, (N,), [m]
    belief_times: Array  # times until which each density is assumed, (K,), [s]
    density: Array  # assumed densities, (K,), [kg/m^3]


def draw_growth(growth: Mapping[str, Growth], *, density_true: float, name: str) -> Figure:
    """Draws the narrowing of the posterior sample by sample, by noise model, with the true density, [kg/m^3]."""
    figure = Figure(figsize=(9.0, 4.0))
    left, right = figure.subplots(1, 2, sharex=True)
    left.axhline(density_true, color="#000000", linewidth=1.0, linestyle=":", label="true density")
    for k, (noise, found) in enumerate(growth.items()):
        colour = OBJECT_COLOURS[2 * k]
        low, median, high = found.quartiles.T
        left.fill_between(found.times, low, high, step="pre", color=colour, alpha=0.25, linewidth=0.0)
        left.step(found.times, median, where="pre", color=colour, linewidth=1.6)
        right.step(found.times, found.sd, where="pre", color=colour, linewidth=1.6, label=noise)
        right.step(
            found.times, found.sd_at_rest, where="pre", color=colour, linestyle="--", linewidth=1.0,
            label="the same by theory, of an arm at rest",
        )  # fmt: skip
    left.set(ylabel="density (kg/m³)", ylim=(0.0, None))
    left.set_title(f"Density believed of {label(name)}: median and quartiles", fontsize=FONT_SIZE)
    left.legend(frameon=False, loc="lower right")
    right.set(yscale="log", ylabel="standard deviation (kg/m³)")
    ticks = [tick for tick in (50, 100, 150, 200, 300, 500, 1000, 2000, 4000) if tick >= 0.7 * _find_least(growth)]
    right.set_yticks(ticks, [str(tick) for tick in ticks])
    right.minorticks_off()
    right.set_ylim(0.85 * _find_least(growth), 1.2 * max(found.sd.max() for found in growth.values()))
    right.set_title("Standard deviation of the belief", fontsize=FONT_SIZE)
    for axes in (left, right):
        axes.set(xlabel="time (s)", xlim=(0.0, max(found.times[-1] for found in growth.values())))
    figure.legend(*right.get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)
    tidy(left, right)
    return figure


def draw_sinking(lines: Mapping[str, Sinking], *, density_true: float, name: str) -> Figure:
    """Draws the height of an object, and the density, [kg/m^3], that control assumes, by the belief that it uses."""
    figure = Figure(figsize=(9.0, 3.8))
    left, right = figure.subplots(1, 2, sharex=True)
    left.axhline(0.0, color="#000000", linewidth=0.8, linestyle=":")
    right.axhline(density_true, color="#000000", linewidth=0.8, linestyle=":", label="true density")
    for k, (belief, found) in enumerate(lines.items()):
        colour = OBJECT_COLOURS[2 * k]
        height = _METRES_TO_CM * found.height
        shown = f"control by {belief}:\n{height.min():.1f} cm at the lowest, {height[-1]:.1f} cm at the end"
        left.plot(found.times, height, color=colour, linewidth=1.6, label=shown)
        right.step(found.belief_times, found.density, where="pre", color=colour, linewidth=1.6)
    left.set_ylabel("height of the object's centre (cm)")
    left.set_title(f"Holding {label(name)} for the first time", fontsize=FONT_SIZE)
    right.set(ylabel="density (kg/m³)", ylim=(0.0, None))
    right.set_title("Most probable density, which control believes", fontsize=FONT_SIZE)
    right.legend(frameon=False, loc="center right")
    for axes in (left, right):
        axes.set(xlabel="time (s)", xlim=(0.0, max(found.times[-1] for found in lines.values())))
    figure.legend(*left.get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)
    tidy(left, right)
    return figure


def _find_least(growth: Mapping[str, Growth]) -> float:
    return float(min(np.minimum(found.sd, found.sd_at_rest).min() for found in growth.values()))
