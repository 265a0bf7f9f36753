"""Figures of the study on real recordings."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy
from studies.recorded.panda import PandaResult
from studies.recorded.peers import TO_90

_PEER_LABELS = {"least_squares": "least squares", "semidefinite": "semidefinite\nprogram", "ours": "ours"}


class Weighing(NamedTuple):
    """Identified mass, with its true value."""

    name: str  # name of the run or object
    mean: float  # posterior mean, [kg]
    low: float  # lower end of the 90 % interval, [kg]
    high: float  # upper end of the 90 % interval, [kg]
    truth: float  # mass measured with a scale, [kg]


def draw_masses(pair: Sequence[Weighing], empty: Weighing, objects: Sequence[Weighing]) -> Figure:
    """Plots identified masses with 90 % intervals next to masses measured with a scale.

    The panels show the UR10e's load in several analyses, its empty hand analysed as if it held a load, and the
    objects on the servo arm.
    """
    figure = Figure(figsize=(12.0, 3.8))
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.3, 0.8, 1.1))
    _draw_weighings(left, pair, 1.0)
    left.set_ylabel("mass (kg)")
    left.set_title("UR10e: gains from the other half", fontsize=FONT_SIZE)
    left.legend(frameon=False)
    _draw_weighings(middle, [empty], 1e3)
    middle.set_ylabel("mass (g)")
    middle.set_title("UR10e: an empty run", fontsize=FONT_SIZE)
    _draw_weighings(right, objects, 1e3)
    right.set_ylabel("mass (g)")
    right.set_title("Servo arm: gains from the other two objects", fontsize=FONT_SIZE)
    tidy(left, middle, right)
    return figure


def draw_injections(result: PandaResult) -> Figure:
    """Plots errors of injected payloads with their 90 % bounds, and coverage for each assumption about the noise."""
    figure = Figure(figsize=(12.0, 4.0))
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    for k, (length, each) in enumerate(result.injections.items()):
        error = 1e3 * (each.mean[:, 0] - each.truth[:, 0])
        colour = OBJECT_COLOURS[k]
        left.plot(each.truth[:, 0], error, ".", color=colour, alpha=0.6, label=f"{length} s")
        sd = 1e3 * TO_90 * float(np.median(each.sd[:, 0]))
        left.axhline(sd, color=colour, linewidth=0.8, linestyle="--")
        left.axhline(-sd, color=colour, linewidth=0.8, linestyle="--")
    left.set(xscale="log", xlabel="true mass (kg)", ylabel="error of the mass (g)")
    left.set_title("Errors; dashed: half of the median 90 % interval", fontsize=FONT_SIZE)
    left.legend(frameon=False, title="window")
    bars = {f"{length} s": float(each.inside[:, 0].mean()) for length, each in result.injections.items()}
    bars |= {
        "5 s, white\nnoise": float(result.control.inside[:, 0].mean()),
        "5 s, least\nsquares": float(result.least_squares[:, 1].mean()),
    }
    colours = [*OBJECT_COLOURS[: len(result.injections)], "#999999", "#555555"]
    _draw_bars(right, bars, colours)
    right.axhline(0.9, color="#000000", linewidth=0.8, linestyle=":")
    right.set_ylim(0.0, 1.08)
    right.set_title("Share of 90 % intervals that contain the mass", fontsize=FONT_SIZE)
    tidy(left, right)
    return figure


def draw_peers(peers: dict[str, dict[str, float]]) -> Figure:
    """Plots errors and times of the compared methods."""
    figure = Figure(figsize=(9.0, 3.4))
    left, right = figure.subplots(1, 2)
    colours = ["#999999", "#555555", OBJECT_COLOURS[0]]
    _draw_bars(left, {_PEER_LABELS[name]: 100.0 * each["mass_error"] for name, each in peers.items()}, colours)
    left.set_ylabel("error of the mass (%)")
    left.set_title("UR10e halves, mean", fontsize=FONT_SIZE)
    _draw_bars(right, {_PEER_LABELS[name]: 1e3 * each["s"] for name, each in peers.items()}, colours)
    right.set_ylabel("time to solution (ms)")
    right.set_title("25 s at 100 Hz; ours with intervals", fontsize=FONT_SIZE)
    tidy(left, right)
    return figure


def _draw_weighings(axes: Axes, weighings: Sequence[Weighing], scale: float) -> None:
    for k, each in enumerate(weighings):
        error = scale * np.array([[each.mean - each.low], [each.high - each.mean]])
        axes.errorbar(k, scale * each.mean, error, fmt="o", color=OBJECT_COLOURS[0], capsize=4.0)
        label = "on a scale" if k == 0 else None
        axes.plot([k - 0.3, k + 0.3], [scale * each.truth] * 2, color=OBJECT_COLOURS[2], label=label)
    axes.set_xticks(range(len(weighings)), [each.name for each in weighings])
    axes.set_xlim(-0.6, len(weighings) - 0.4)


def _draw_bars(axes: Axes, values: dict[str, float], colours: list[str]) -> None:
    axes.bar(range(len(values)), list(values.values()), color=colours, width=0.6)
    for k, value in enumerate(values.values()):
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        axes.annotate(
            f"{value:.3g}", (k, value), (0, 3), textcoords="offset points", ha="center", fontsize=9, bbox=box
        )
    axes.set_xticks(range(len(values)), list(values), fontsize=8)
