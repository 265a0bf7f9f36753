"""Figure of the study of arms: how far each arm sags and why, and how much the costs of grips differ."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from affordance.reporting.figures import OBJECT_COLOURS, tidy
from studies.arms.report import FREE, get_excess, get_mass_ratio

_FONT = 7.5
_FALL = "simulated fall of the first object (cm)"
_MASS = "effective mass of the arm, up and down at the hand,"


def draw_study(found: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> Figure:
    """Plots the results of all imported robots and of our own arm."""
    known = {name: one for name, one in found.items() if "sag" in one}
    figure = Figure(figsize=(13.0, 5.0))
    left, middle, right = figure.subplots(1, 3)
    _draw_predictions(left, known, ours)
    _draw_masses(middle, known, ours)
    _draw_works(right, known, ours)
    tidy(left, middle, right)
    return figure


def _draw_predictions(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    """Plots the simulated fall of the first object against the predicted fall, with and without rotors."""
    for name, one in {**known, "ours": ours}.items():
        sag = one["sag"]
        marker = "s" if sag["limited"] > FREE else "o"
        _mark(axes, name, 100.0 * sag["predicted"], 100.0 * sag["simulated"], marker)
    rotors = [sag for one in known.values() for sag in one["sag_with_rotors"].values()]
    if rotors:
        x, y = (100.0 * np.array([sag[key] for sag in rotors]) for key in ("predicted", "simulated"))
        axes.plot(x, y, ".", color=OBJECT_COLOURS[1], markersize=4.0, label="with rotors of 0.03, 0.1, 0.3 kg m²")
    ends = np.array(axes.get_xlim())
    span = np.array([max(0.05, 0.5 * ends[0]), 1.2 * ends[1]])
    axes.plot(span, span, "-", color="#000000", linewidth=0.8, label="as predicted")
    axes.plot([], [], "o", color=OBJECT_COLOURS[0], label="rotors as in the file (squares: a limit active)")
    _finish(axes, "predicted fall, (1 + 1/N) T²/6 times the unforeseen acceleration (cm)", _FALL)
    axes.legend(frameon=False, fontsize=_FONT, loc="upper left")


def _draw_masses(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    """Plots the fall of the first object against the ratio of the arm's effective mass to the object's."""
    for name, one in {**known, "ours": ours}.items():
        _mark(axes, name, get_mass_ratio(one["sag"]), 100.0 * one["sag"]["simulated"])
    for one in known.values():
        path = [one["sag"], *one["sag_with_rotors"].values()]
        x, y = [get_mass_ratio(sag) for sag in path], [100.0 * sag["simulated"] for sag in path]
        axes.plot(x, y, "-", color=OBJECT_COLOURS[1], linewidth=0.7)
    axes.plot([], [], "-", color=OBJECT_COLOURS[1], label="the same arm with rotors up to 0.3 kg m²")
    _finish(axes, f"{_MASS}\ndivided by the mass of the object", _FALL)
    axes.legend(frameon=False, fontsize=_FONT, loc="upper right")


def _draw_works(axes: Axes, known: Mapping[str, Mapping[str, Any]], ours: Mapping[str, Any]) -> None:
    for task, colour, marker in (("reach", OBJECT_COLOURS[0], "o"), ("hammer", OBJECT_COLOURS[4], "^")):
        able = {name: one for name, one in {**known, "ours": ours}.items() if task in one}
        for name, one in able.items():
            x, y = get_mass_ratio(one["sag"]), 100.0 * get_excess(one, task)
            _mark(axes, name if task == "reach" else "", x, y, marker, colour)
        if able:
            axes.plot([], [], marker, color=colour, markersize=6.0, label=task)
    _finish(
        axes,
        f"{_MASS}\ndivided by the mass of the first object of Simulation I",
        "extra cost of the costlier grip (%)",
    )
    axes.legend(frameon=False, fontsize=_FONT)


def _mark(axes: Axes, name: str, x: float, y: float, marker: str = "o", colour: str = "") -> None:
    """Plots and names the point of an arm; our own arm has its own colour unless a colour is given."""
    colour = colour or OBJECT_COLOURS[2 if name == "ours" else 0]
    axes.plot(x, y, marker, color=colour, markersize=6.0)
    if name:
        axes.annotate(name, (x, y), xytext=(4, -3), textcoords="offset points", fontsize=_FONT)


def _finish(axes: Axes, x_label: str, y_label: str) -> None:
    axes.set(xscale="log", yscale="log", xlabel=x_label, ylabel=y_label)
