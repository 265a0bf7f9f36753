"""Figure of the study of arms: how far each arm sags and why, and by how much the costs of the grips differ."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.reporting.figures import OBJECT_COLOURS, tidy

_FONT = 7.5


def draw_study(found: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> Figure:
    """Draws the figure of the study.

    Args:
        found: Results by robot; robots that were not imported are left out.
        ours: Results of the arm that comes with the program.
    """
    known = {name: one for name, one in found.items() if "sag" in one}
    figure = Figure(figsize=(13.0, 5.0))
    left, middle, right = figure.subplots(1, 3)
    _draw_predictions(left, known, ours)
    _draw_masses(middle, known, ours)
    _draw_works(right, known, ours)
    tidy(left, middle, right)
    return figure


def _draw_predictions(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    """Draws the simulated fall of the first object over that predicted by the formula, with and without rotors."""
    points = {**{name: one["sag"] for name, one in known.items()}, "ours": ours["sag"]}
    for name, sag in points.items():
        x, y = 100.0 * sag["predicted"], 100.0 * sag["simulated"]
        limited = sag["limited"] > 0.05
        axes.plot(x, y, "s" if limited else "o", color=OBJECT_COLOURS[2 if name == "ours" else 0], markersize=6.0)
        axes.annotate(name, (x, y), xytext=(4, -3), textcoords="offset points", fontsize=_FONT)
    rotors = [sag for one in known.values() for sag in one["sag_with_rotors"].values()]
    if rotors:
        x, y = (100.0 * np.array([sag[key] for sag in rotors]) for key in ("predicted", "simulated"))
        axes.plot(x, y, ".", color=OBJECT_COLOURS[1], markersize=4.0, label="with rotors of 0.03, 0.1, 0.3 kg m²")
    ends = np.array(axes.get_xlim())
    span = np.array([max(0.05, 0.5 * ends[0]), 1.2 * ends[1]])
    axes.plot(span, span, "-", color="#000000", linewidth=0.8, label="as predicted")
    axes.plot([], [], "o", color=OBJECT_COLOURS[0], label="as in the file (squares: a limit active)")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("fall predicted, (1 + 1/N) T²/6 of the unforeseen acceleration (cm)")
    axes.set_ylabel("fall of the first object, simulated (cm)")
    axes.legend(frameon=False, fontsize=_FONT, loc="upper left")


def _draw_masses(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    """Draws the fall of the first object over the ratio of the arm's effective mass to the object's."""
    points = {**known, "ours": ours}
    for name, one in points.items():
        sag = one["sag"]
        x, y = sag["arm_mass"] / sag["object_mass"], 100.0 * sag["simulated"]
        axes.plot(x, y, "o", color=OBJECT_COLOURS[2 if name == "ours" else 0], markersize=6.0)
        axes.annotate(name, (x, y), xytext=(4, -3), textcoords="offset points", fontsize=_FONT)
    for one in known.values():
        path = [one["sag"], *one["sag_with_rotors"].values()]
        x = [sag["arm_mass"] / sag["object_mass"] for sag in path]
        axes.plot(x, [100.0 * sag["simulated"] for sag in path], "-", color=OBJECT_COLOURS[1], linewidth=0.7)
    axes.plot([], [], "-", color=OBJECT_COLOURS[1], label="the same arm with rotors up to 0.3 kg m²")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("effective mass of the arm, up and down at the hand,\nover the mass of the object")
    axes.set_ylabel("fall of the first object, simulated (cm)")
    axes.legend(frameon=False, fontsize=_FONT, loc="upper right")


def _draw_works(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    """Draws the additional cost of the costlier grip, in reaching and hammering."""
    points = {**known, "ours": ours}
    for task, colour, marker in (("reach", OBJECT_COLOURS[0], "o"), ("hammer", OBJECT_COLOURS[4], "^")):
        drawn = False
        for name, one in points.items():
            if task not in one:
                continue
            x = one["sag"]["arm_mass"] / one["sag"]["object_mass"]
            y = 100.0 * (one[task]["energy_ratio_true"] - 1.0)
            axes.plot(x, y, marker, color=colour, markersize=6.0, label=None if drawn else task)
            drawn = True
            if task == "reach":
                axes.annotate(name, (x, y), xytext=(4, -3), textcoords="offset points", fontsize=_FONT)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(
        "effective mass of the arm, up and down at the hand,\nover the mass of the first object of Simulation I"
    )
    axes.set_ylabel("the dearer grip costs more by (%)")
    axes.legend(frameon=False, fontsize=_FONT)
