"""Pictures of the study on real recordings."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.experiments.recorded.clones import UR10E_LOAD, WeighedObject
from affordance.experiments.recorded.panda import PandaResult
from affordance.experiments.recorded.ur10e import Ur10eResult
from affordance.experiments.recorded.weighed_objects import WeighedResult
from affordance.reporting.figures import FONT_SIZE, OBJECT_COLOURS, tidy

_TO_90 = 1.645
_PEER_LABELS = {"least_squares": "least squares", "semidefinite": "semidefinite\nprogram", "ours": "ours"}


def draw_masses(ur10e: Ur10eResult, weighed: WeighedResult, objects: dict[str, WeighedObject]) -> Figure:
    """Draws identified masses with their 90 % intervals beside what scales say."""
    figure = Figure(figsize=(12.0, 3.8))
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.3, 1, 1.1))
    details = ur10e.details
    rows = [
        ("first half", ur10e.halves.mass[0], ur10e.halves.sd[0]),
        ("second half", ur10e.halves.mass[1], ur10e.halves.sd[1]),
        ("unpaired", details["unpaired_mass_kg"], details["unpaired_mass_sd_kg"]),
    ]
    for k, (_, mass, sd) in enumerate(rows):
        left.errorbar(k, mass, _TO_90 * sd, fmt="o", color=OBJECT_COLOURS[0], capsize=4.0)
    left.axhline(UR10E_LOAD, color=OBJECT_COLOURS[2], label="on a scale")
    left.set_xticks(range(len(rows)), [name for name, *_ in rows])
    left.set_xlim(-0.5, len(rows) - 0.5)
    left.set_ylabel("mass (kg)")
    left.set_title("UR10e: gains from the other half", fontsize=FONT_SIZE)
    left.legend(frameon=False)
    numbers = ur10e.numbers
    middle.errorbar(
        0,
        1e3 * numbers["empty_as_load_kg"],
        1e3 * _TO_90 * numbers["empty_as_load_sd_kg"],
        fmt="o",
        color=OBJECT_COLOURS[0],
        capsize=4.0,
    )
    middle.axhline(0.0, color=OBJECT_COLOURS[2])
    middle.set_xticks([0], ["empty hand"])
    middle.set_xlim(-1.0, 1.0)
    middle.set_ylabel("mass (g)")
    middle.set_title("UR10e: an empty run taken for a loaded one", fontsize=FONT_SIZE)
    for k, (name, belief) in enumerate(weighed.beliefs.items()):
        low, high = belief.mass_interval90
        error = 1e3 * np.array([[belief.mass - low], [high - belief.mass]])
        right.errorbar(k, 1e3 * belief.mass, error, fmt="o", color=OBJECT_COLOURS[0], capsize=4.0)
        right.plot([k - 0.25, k + 0.25], [1e3 * objects[name].mass] * 2, color=OBJECT_COLOURS[2])
    right.set_xticks(range(len(weighed.beliefs)), list(weighed.beliefs))
    right.set_ylabel("mass (g)")
    right.set_title("Servo arm: gains from the other two objects", fontsize=FONT_SIZE)
    tidy(left, middle, right)
    return figure


def draw_injections(result: PandaResult) -> Figure:
    """Draws errors of injected payloads against what was claimed, and coverage by what is assumed of the noise."""
    figure = Figure(figsize=(12.0, 4.0))
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    for k, (length, each) in enumerate(result.injections.items()):
        error = 1e3 * (each.mean[:, 0] - each.truth[:, 0])
        colour = OBJECT_COLOURS[k]
        left.plot(each.truth[:, 0], error, ".", color=colour, alpha=0.6, label=f"{length} s")
        sd = 1e3 * _TO_90 * float(np.median(each.sd[:, 0]))
        left.axhline(sd, color=colour, linewidth=0.8, linestyle="--")
        left.axhline(-sd, color=colour, linewidth=0.8, linestyle="--")
    left.set_xscale("log")
    left.set_xlabel("true mass (kg)")
    left.set_ylabel("error of the mass (g)")
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
    right.set_title("Share of 90 % intervals of the mass that hold it", fontsize=FONT_SIZE)
    tidy(left, right)
    return figure


def draw_peers(peers: dict[str, dict[str, float]]) -> Figure:
    """Draws errors and times of methods side by side."""
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


def _draw_bars(axes: Axes, values: dict[str, float], colours: list[str]) -> None:
    axes.bar(range(len(values)), list(values.values()), color=colours, width=0.6)
    for k, value in enumerate(values.values()):
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        place = {"xytext": (0, 3), "textcoords": "offset points", "ha": "center"}
        axes.annotate(f"{value:.3g}", (k, value), fontsize=9, bbox=box, **place)
    axes.set_xticks(range(len(values)), list(values), fontsize=8)
