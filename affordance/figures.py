"""Pictures of results. The colours are those of Okabe & Ito, which the colour-blind tell apart; heights are in cm."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from affordance.metrics import Estimate
from affordance.results import write_whole

Array = NDArray[np.float64]

# In the order of the paper's figure 4: blue, green, red, cyan; the decoy magenta.
OBJECT_COLOURS = ("#0072B2", "#009E73", "#D55E00", "#56B4E9", "#E69F00", "#000000")
DECOY_COLOUR = "#CC79A7"
# Told apart by these when there are more objects than colours.
_LINE_STYLES = ("-", "--", "-.", ":")
_FONT_SIZE = 10
_METRES_TO_CM = 100.0


def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Writes a figure as NAME.png and NAME.svg, each whole, the same bytes for the same figure."""
    matplotlib.rcParams["svg.hashsalt"] = "affordance"
    figure.set_layout_engine("constrained")
    write_whole(folder / f"{name}.png", lambda path: figure.savefig(path, dpi=200))
    write_whole(folder / f"{name}.svg", lambda path: figure.savefig(path, metadata={"Date": None}))


def draw_density_and_drop(
    *, quartiles: Array, mode: Array, density_true: float, drop: Estimate, masses: Array, num_repeats: int
) -> Figure:
    """Draws figure 3: the density believed after each trial, and how far the arm dropped in each.

    Args:
        quartiles: 25th, 50th and 75th percentile before the first and after each trial, shape (K + 1, 3), [kg/m^3].
        mode: Most probable density at the same moments, which control uses, shape (K + 1,), [kg/m^3].
        density_true: The true density, [kg/m^3].
        drop: Drop in each trial, shape (K,), [m].
        masses: True mass of each object, shape (K,), [kg].
        num_repeats: How many observers the numbers are of.
    """
    figure = Figure(figsize=(9.0, 3.8))
    left, right = figure.subplots(1, 2)
    trials = np.arange(len(quartiles))
    left.axhline(density_true, color="#000000", linewidth=1.2, label="true density")
    left.plot(trials, quartiles[:, 1], "o-", color=OBJECT_COLOURS[0], label="median of the belief")
    left.plot(trials, quartiles[:, 2], "--", color=OBJECT_COLOURS[0], label="25th and 75th percentile")
    left.plot(trials, quartiles[:, 0], "--", color=OBJECT_COLOURS[0])
    left.plot(trials, mode, "x", color=OBJECT_COLOURS[2], markersize=8.0, label="most probable (used in control)")
    left.set_xticks(trials, ["before", *(f"after {k}" for k in trials[1:])])
    left.set_xlabel("trial")
    left.set_ylabel("density (kg/m³)")
    left.set_ylim(0.0, 1.2 * max(density_true, quartiles.max()))
    left.legend(frameon=False, loc="lower right")
    left.set_title(f"Density believed, median of {num_repeats} observers", fontsize=_FONT_SIZE)

    positions = np.arange(1, len(masses) + 1)
    height = _METRES_TO_CM * drop.mean
    error = _METRES_TO_CM * np.array([drop.mean - drop.low, drop.high - drop.mean])
    right.bar(
        positions, height, color=[_style(k)[0] for k in range(len(masses))], yerr=error, capsize=4.0, width=0.65
    )
    for position, value, top in zip(positions, height, height + error[1], strict=True):
        right.annotate(
            f"{value:.2f}", (position, top), xytext=(0, 4), textcoords="offset points", ha="center", fontsize=9
        )
    right.set_xticks(positions, [f"{k}\n{mass:.2f} kg" for k, mass in zip(positions, masses, strict=True)])
    right.set_xlabel("trial, and mass of its object")
    right.set_ylabel("drop (cm)")
    right.set_ylim(0.0, 1.15 * (height + error[1]).max())
    right.set_title(f"Drop of the object, mean of {num_repeats} and 95 % interval", fontsize=_FONT_SIZE)
    _tidy(left, right)
    return figure


def draw_heights(
    *, times: Array, shown: Array, mean: Estimate, labels: list[str], shown_label: str, num_repeats: int
) -> Figure:
    """Draws figure 4: the height of each object over time; the last is the decoy.

    Args:
        times: (N,), [s].
        shown: Heights in one run, shape (K, N), [m].
        mean: Heights over repeats, shape (K, N), [m].
        labels: Name of each object.
        shown_label: Which run is shown.
        num_repeats: How many observers the mean is of.
    """
    figure = Figure(figsize=(12.0, 3.8))
    one, every, near = figure.subplots(1, 3, sharex=True)
    styles = [*(_style(k) for k in range(len(labels) - 1)), (DECOY_COLOUR, "-")]
    for k, (label, (colour, line)) in enumerate(zip(labels, styles, strict=True)):
        one.plot(times, _METRES_TO_CM * shown[k], line, color=colour, label=label, linewidth=1.6)
        for axes in (every, near):
            axes.plot(times, _METRES_TO_CM * mean.mean[k], line, color=colour, linewidth=1.6)
            low, high = _METRES_TO_CM * mean.low[k], _METRES_TO_CM * mean.high[k]
            axes.fill_between(times, low, high, color=colour, alpha=0.3, linewidth=0.0)
    every.sharey(one)
    learned = _METRES_TO_CM * max(np.abs(mean.low[1:-1]).max(), np.abs(mean.high[1:-1]).max())
    near.set_ylim(-1.5 * learned, 1.5 * learned)
    for axes in (one, every, near):
        axes.axhline(0.0, color="#000000", linewidth=0.8, linestyle=":")
        axes.set_xlabel("time (s)")
        axes.set_xlim(times[0], times[-1])
    one.set_ylabel("height of the object's centre (cm)")
    one.set_title(f"One observer ({shown_label})", fontsize=_FONT_SIZE)
    every.set_title(f"Mean of {num_repeats} observers, 95 % interval", fontsize=_FONT_SIZE)
    near.set_title("The same, enlarged around the goal", fontsize=_FONT_SIZE)
    figure.legend(frameon=False, loc="outside lower center", ncols=min(len(labels), 6))
    _tidy(one, every, near)
    return figure


def _style(k: int) -> tuple[str, str]:
    """Colour and line of the k-th object."""
    return OBJECT_COLOURS[k % len(OBJECT_COLOURS)], _LINE_STYLES[k // len(OBJECT_COLOURS) % len(_LINE_STYLES)]


def _tidy(*all_axes: Axes) -> None:
    for axes in all_axes:
        axes.spines[["top", "right"]].set_visible(False)
