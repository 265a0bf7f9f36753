"""Plots figures of results in the colour-blind safe palette of Okabe & Ito. Heights are in cm."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from affordance.arrays import Array
from affordance.files.atomic import write_atomic
from affordance.reporting.formatting import count_observers, label
from affordance.reporting.statistics import Estimate

# Colours of the paper's figure 4, in its order: blue, green, red and cyan. The decoy is magenta.
OBJECT_COLOURS = ("#0072B2", "#009E73", "#D55E00", "#56B4E9", "#E69F00", "#000000")
DECOY_COLOUR = "#CC79A7"
# Markers and line styles, which distinguish objects if there are more objects than colours.
MARKERS = ("o", "s", "^")
LINE_STYLES = ("-", "--", "-.", ":")
FONT_SIZE = 10
# Largest number of objects for which all ticks have words or units.
_MOST_WIDE_TICKS = 6
# Width of a legend below a figure, and width of the line of each entry, [characters].
_LEGEND_WIDTH, _LEGEND_LINE = 130, 10
# Width of a legend below a panel, [characters].
_PANEL_WIDTH = 66
_NARROW = 22
_METRES_TO_CM = 100.0


def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Writes a figure as NAME.png and NAME.svg. Writing is atomic, and the files are reproducible byte by byte."""
    matplotlib.rcParams["svg.hashsalt"] = "affordance"
    prepare_figure(figure)
    write_atomic(folder / f"{name}.png", lambda path: figure.savefig(path, dpi=200))
    write_atomic(folder / f"{name}.svg", lambda path: figure.savefig(path, metadata={"Date": None}))


def prepare_figure(figure: Figure) -> None:
    """Turns on automatic layout if a figure has no layout engine, and makes dollar signs literal."""
    if figure.get_layout_engine() is None:
        figure.set_layout_engine("constrained")
    for text in figure.findobj(Text):  # Matplotlib sets tick labels later, so powers of ten remain formulae.
        text.set_parse_math("$" not in text.get_text())


def count_columns(labels: Sequence[str]) -> int:
    """Computes how many labels fit in a row of a legend below a 12-inch figure, at most 6."""
    longest = max(len(line) for each in labels for line in each.split("\n"))
    return max(1, min(len(labels), 6, _LEGEND_WIDTH // (_LEGEND_LINE + longest)))


def tidy(*all_axes: Axes) -> None:
    """Removes the top and right spines of plots."""
    for axes in all_axes:
        axes.spines[["top", "right"]].set_visible(False)


def darken(colour: str) -> tuple[float, float, float]:
    """Mixes a colour with an equal amount of black."""
    red, green, blue = (0.5 * part for part in to_rgb(colour))
    return red, green, blue


def draw_density_and_drop(
    *, quartiles: Array, mode: Array, density_true: float, drop: Estimate, masses: Array, num_repeats: int
) -> Figure:
    """Plots figure 3: the belief about density after each of K trials, and the drop of the arm at two scales.

    Args:
        quartiles: Quartiles of the belief before the first and after each trial, (K + 1, 3), [kg/m^3].
        mode: Mode of the belief, which the controller uses, at the same times, (K + 1,), [kg/m^3].
        density_true: True density, [kg/m^3].
        drop: Drop of the arm in each trial, (K,), [m].
        masses: Mass of the object in each trial, (K,), [kg].
        num_repeats: Number of observers.
    """
    figure = Figure(figsize=(12.0, 3.8))
    left, right, near = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 1.0))
    trials = np.arange(len(quartiles))
    left.axhline(density_true, color="#000000", linewidth=1.2, label="true density")
    left.plot(trials, quartiles[:, 1], "o-", color=OBJECT_COLOURS[0], label="median of the belief")
    left.plot(trials, quartiles[:, 2], "--", color=OBJECT_COLOURS[0], label="25th and 75th percentile")
    left.plot(trials, quartiles[:, 0], "--", color=OBJECT_COLOURS[0])
    left.plot(trials, mode, "x", color=OBJECT_COLOURS[2], markersize=8.0, label="most probable (used in control)")
    crowded = len(masses) > _MOST_WIDE_TICKS
    left.set_xticks(trials, [*trials] if crowded else ["before", *(f"after {k}" for k in trials[1:])])
    left.set(
        xlabel="trials so far" if crowded else "trial",
        ylabel="density (kg/m³)",
        ylim=(0.0, 1.2 * max(density_true, quartiles.max())),
    )
    left.legend(frameon=False, loc="lower right")
    left.set_title(f"Believed density, median of {count_observers(num_repeats)}", fontsize=FONT_SIZE)

    _draw_drops(right, drop, masses, crowded=crowded)
    right.set_title(f"Drop, mean of {count_observers(num_repeats)}, 95 % interval", fontsize=FONT_SIZE)
    if len(masses) > 1:  # the first object is unknown, so its drop dwarfs the others
        _draw_drops(near, drop, masses, crowded=crowded, first=1)
        near.set_title("The same after the first trial, enlarged", fontsize=FONT_SIZE)
    else:
        near.remove()
    tidy(*figure.axes)
    return figure


def _draw_drops(axes: Axes, drop: Estimate, masses: Array, *, crowded: bool, first: int = 0) -> None:
    """Plots the mean drop in each trial from ``first`` on, [m]. Ticks are labelled with the objects' masses, [kg]."""
    positions = np.arange(first, len(masses)) + 1
    height, low, high = (_METRES_TO_CM * each[first:] for each in drop)
    colours = [_style(k)[0] for k in range(first, len(masses))]
    axes.bar(positions, height, color=colours, yerr=[height - low, high - height], capsize=4.0, width=0.65)
    for position, value, top in zip(positions, height, high, strict=True):
        axes.annotate(
            f"{value:.2f}", (position, top), xytext=(0, 4), textcoords="offset points", ha="center", fontsize=9
        )
    unit, unit_of_axis = ("", " (kg)") if crowded else (" kg", "")
    axes.set_xticks(positions, [f"{k}\n{masses[k - 1]:.2f}{unit}" for k in positions])
    axes.set_xlabel(f"trial, and mass of its object{unit_of_axis}")
    axes.tick_params(axis="x", labelsize=7 if crowded else None)
    axes.set(ylabel="drop (cm)", ylim=(0.0, 1.15 * high.max() or 1.0))


def draw_heights(
    *, times: Array, shown: Array, mean: Estimate, labels: list[str], shown_label: str, num_repeats: int
) -> Figure:
    """Plots figure 4: the height of each of K objects over time. The last object is the decoy.

    Args:
        times: Times, (N,), [s].
        shown: Heights for one observer, (K, N), [m].
        mean: Mean heights over all observers, (K, N), [m].
        labels: Labels of the objects.
        shown_label: Name of the observer in ``shown``.
        num_repeats: Number of observers.
    """
    figure = Figure(figsize=(12.0, 3.8))
    one, every, near = figure.subplots(1, 3, sharex=True)
    styles = [*(_style(k) for k in range(len(labels) - 1)), (DECOY_COLOUR, "-")]
    names = [label(name) for name in labels]
    for k, (name, (colour, line)) in enumerate(zip(names, styles, strict=True)):
        one.plot(times, _METRES_TO_CM * shown[k], line, color=colour, label=name, linewidth=1.6)
        for axes in (every, near):
            _plot_mean(axes, times, Estimate(*(each[k] for each in mean)), line, colour)
    every.sharey(one)
    _mark_times(times, one, every, near)
    # Limits are computed from the curves, because the intervals of few observers exceed the region to enlarge.
    low, high = every.get_ylim()
    if len(labels) > 2:  # limits exclude the decoy and the first object, which is still unknown
        learned = 1.5 * _METRES_TO_CM * float(np.abs(mean.mean[1:-1]).max())
        near.set_ylim(max(low, -learned), min(high, learned))
    one.set_ylabel("height above the goal (cm)")
    one.set_title(f"One observer ({shown_label})", fontsize=FONT_SIZE)
    every.set_title(f"Mean of {count_observers(num_repeats)}, 95 % interval", fontsize=FONT_SIZE)
    enlarged = near.get_ylim() != (low, high)
    near.set_title("The same, enlarged around the goal" if enlarged else "The same", fontsize=FONT_SIZE)
    figure.legend(frameon=False, loc="outside lower center", ncols=count_columns(names))
    tidy(one, every, near)
    return figure


def draw_heights_of_points(
    *,
    times: Array,
    shown: Array,
    mean: Estimate,
    decoy: dict[str, Estimate],
    labels: list[str],
    shown_label: str,
    num_repeats: int,
) -> Figure:
    """Plots figure 6: heights of K objects, and of several points of the decoy. The last object is the decoy.

    Args:
        times: Times, (N,), [s].
        shown: Heights of the objects' centres for one observer, (K, N), [m].
        mean: Mean heights of the centres over all observers, (K, N), [m].
        decoy: Mean heights of points of the decoy, (N,) each, [m], by the point's label.
        labels: Labels of the objects.
        shown_label: Name of the observer in ``shown``.
        num_repeats: Number of observers.
    """
    figure = Figure(figsize=(12.0, 4.4))
    one, every, points = figure.subplots(1, 3, sharex=True, sharey=True)
    # Colours of the paper's figure 6: red and blue, and green for the decoy.
    of_decoy, *others = (OBJECT_COLOURS[i] for i in (1, 2, 0, 3, 4, 5))
    for k in range(len(labels)):
        colour = of_decoy if k == len(labels) - 1 else others[k % len(others)]
        one.plot(times, _METRES_TO_CM * shown[k], color=colour, linewidth=1.6)
        _plot_mean(every, times, Estimate(*(each[k] for each in mean)), "-", colour, labels[k])
    for k, (point, heights) in enumerate(decoy.items()):
        # All points have the decoy's colour as long as there are enough line styles to distinguish them.
        line = LINE_STYLES[k % len(LINE_STYLES)]
        colour = (of_decoy, *others)[k // len(LINE_STYLES) % len(OBJECT_COLOURS)]
        _plot_mean(points, times, heights, line, colour, point)
    _mark_times(times, one, every, points)
    one.set_ylabel("height above the goal (cm)")
    one.set_title(f"Objects' centres, one observer ({shown_label})", fontsize=FONT_SIZE)
    every.set_title(f"Mean of {count_observers(num_repeats)}, 95 % interval", fontsize=FONT_SIZE)
    points.set_title("Points of the decoy, the same mean", fontsize=FONT_SIZE)
    # The first legend describes two of the three plots.
    figure.legend(*every.get_legend_handles_labels(), frameon=False, loc="outside lower left")
    figure.legend(*points.get_legend_handles_labels(), frameon=False, loc="outside lower right")
    tidy(one, every, points)
    # Panels share their height axis. Without padding, the last tick of a time axis touches the first tick of the
    # next.
    figure.set_layout_engine("constrained", w_pad=0.12)
    return figure


def draw_choices(panels: Mapping[str, Mapping[str, Estimate]], *, title: str) -> Figure:
    """Plots figures 8 and 10: the proportion of correct choices over trials.

    Args:
        panels: For each panel title, proportions before the first and after each of K trials, (K + 1,), by label.
        title: Title of the figure.
    """
    figure = Figure(figsize=(1.2 + 5.2 * len(panels), 4.9))
    all_axes = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
    spread = 0.06  # horizontal offset, so that intervals do not hide each other
    for axes, (about, curves) in zip(all_axes, panels.items(), strict=True):
        for k, (name, curve) in enumerate(curves.items()):
            trials = np.arange(len(curve.mean)) + spread * (k - (len(curves) - 1) / 2)
            error = np.maximum(0.0, [curve.mean - curve.low, curve.high - curve.mean])
            style, colour = f"{MARKERS[k % len(MARKERS)]}-", _style(k)[0]
            axes.errorbar(trials, curve.mean, error, fmt=style, color=colour, capsize=3.0, label=label(name))
        axes.axhline(0.5, color="#000000", linewidth=0.8, linestyle=":", label="one half")
        axes.set(ylim=(0.0, 1.04), xlabel="trials of experience with other objects")
        axes.set_title(about, fontsize=FONT_SIZE)
        ncols = max(1, min(3, _PANEL_WIDTH // (_LEGEND_LINE + max(len(label(name)) for name in curves))))
        axes.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=ncols)
    all_axes[0].set_ylabel("proportion of correct choices")
    figure.suptitle(title, fontsize=FONT_SIZE)
    tidy(*all_axes)
    return figure


def draw_paths(reference: Array, paths: dict[str, Array]) -> Figure:
    """Plots the required path and the executed paths from above and from behind.

    Args:
        reference: Points of the required path, (N, 3), [m].
        paths: Points of each executed path, (N, 3), [m], by label.
    """
    figure = Figure(figsize=(9.0, 4.2))
    above, aside = figure.subplots(1, 2)
    for axes, (i, j) in ((above, (0, 1)), (aside, (1, 2))):
        for k, (name, path) in enumerate(paths.items()):
            colour, _ = _style(k)
            line = LINE_STYLES[k % len(LINE_STYLES)]
            axes.plot(
                _METRES_TO_CM * path[:, i], _METRES_TO_CM * path[:, j], line, color=colour, label=label(name, _NARROW)
            )
        asked = _METRES_TO_CM * reference
        axes.plot(asked[:, i], asked[:, j], ":", color="#000000", label="demanded")
        axes.plot(asked[0, i], asked[0, j], "o", color="#000000", markersize=5.0, label="start")
        axes.set(xlabel=f"{'xyz'[i]} (cm)", ylabel=f"{'xyz'[j]} (cm)", aspect="equal")
    above.set_title("From above (x forward, y to the left)", fontsize=FONT_SIZE)
    aside.set_title("From behind (y to the left, z up)", fontsize=FONT_SIZE)
    aside.invert_xaxis()
    above.legend(frameon=False)
    tidy(above, aside)
    return figure


def _mark_times(times: Array, *all_axes: Axes) -> None:
    """Labels the time axes and marks the goal height. Only the first plot gets a legend."""
    for axes in all_axes:
        goal = axes.axhline(0.0, color="#000000", linewidth=1.2, linestyle=":")
        axes.set(xlabel="time (s)", xlim=(times[0], times[-1]))
    all_axes[0].legend([goal], ["goal: the height at the start"], frameon=False, loc="best")


def _plot_mean(axes: Axes, times: Array, heights: Estimate, line: str, colour: str, name: str = "") -> None:
    """Plots mean heights with their interval, [m]. Without a ``name``, they are not in the legend."""
    mean, low, high = (_METRES_TO_CM * each for each in heights)
    axes.plot(times, mean, line, color=colour, label=label(name) if name else None, linewidth=1.6)
    axes.fill_between(times, low, high, color=colour, alpha=0.3, linewidth=0.0)


def _style(k: int) -> tuple[str, str]:
    """Returns the colour and line style of the k-th object."""
    return OBJECT_COLOURS[k % len(OBJECT_COLOURS)], LINE_STYLES[k // len(OBJECT_COLOURS) % len(LINE_STYLES)]
