"""Figures and trajectories of simulated presentations, as a protocol asks for them."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.experiments.definition import OBSERVER_SHOWN, Arrays
from affordance.experiments.shared.presented import QUARTILES, PresentedExperiment
from affordance.experiments.shared.trajectories import HEIGHTS, label_heights, label_motions
from affordance.files.netcdf import LabelledArray
from affordance.objects.tool import Tool
from affordance.protocols.measured import select_presentations
from affordance.protocols.number_entries import FigureEntry, Measure
from affordance.reporting import figures, statistics
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.simulation.trial_record import TrialRecord


def draw_figures(experiment: PresentedExperiment, arrays: Arrays) -> dict[str, Callable[[], Figure]]:
    """Returns a function for each figure of a protocol, except those of lifts and of single trials.

    Args:
        experiment: Experiment of the protocol.
        arrays: Arrays of all observers of all learners; the first learner is drawn.
    """
    draw = {"objects": _draw_objects, "heights": _draw_heights, "heights of points": _draw_points}
    draw |= {"density and drop": _draw_density}
    return {
        name: partial(draw[entry.draw], entry, experiment, arrays)
        for name, entry in experiment.figures.items()
        if entry.draw in draw
    }


def label_results(
    arrays: Arrays, quantiles: Sequence[float], records: Sequence[TrialRecord | None]
) -> dict[str, LabelledArray]:
    """Labels the arrays of all observers, and the motions of the one that is shown."""
    moments = "percentile of the believed density of the first material, before the first and after each presentation"
    labelled = {
        **label_heights(arrays),
        "density": LabelledArray(("repeat", "moment", "percentile"), arrays["density_quantiles"], "kg/m^3", moments),
        "percentile": LabelledArray(("percentile",), 100.0 * np.array(quantiles), "%", "percentile"),
        **label_motions(records, f"observer {OBSERVER_SHOWN}"),
    }
    for name, unit, meaning in (("force", "N", "upward force before release"), ("work", "J", "mechanical work")):
        if name in arrays:
            labelled[name] = LabelledArray(("repeat", "trial"), arrays[name], unit, meaning)
    if "parameters_predicted" in arrays:
        masses = arrays["parameters_predicted"][..., 0]
        labelled["mass_predicted"] = LabelledArray(("repeat", "trial"), masses, "kg", "mass predicted before each")
    return labelled


def _draw_objects(entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> Figure:
    objects = experiment.objects
    decoys = [] if entry.decoy is None else objects.select(entry.decoy)
    drawings = []
    for number, tool in enumerate(objects.select(entry.of), start=1):
        if tool not in decoys:
            drawings.append(Drawing(tool, f"{number}: {tool.name}"))
            continue
        drawings.append(Drawing(tool, f"{number}: {tool.name}, as it looks"))
        drawings.append(Drawing(tool, f"{number}: {tool.name}, as it is made", as_made=True))
    return draw_objects(drawings, columns=2)


def _draw_heights(entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    return figures.draw_heights(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        labels=[tool.name for tool in _list_presented(entry, experiment, arrays)],
        shown_label=f"seed {experiment.seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_points(entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    decoy = FigureEntry(draw=entry.draw, of=entry.decoy or entry.of)
    points = {name: _select(arrays[name], decoy, experiment, arrays)[:, -1] for name in HEIGHTS}
    titles = {"height_centre": "geometric centre", "height_grip": "grip", "height_com": "true centre of mass"}
    names = [tool.name for tool in _list_presented(entry, experiment, arrays)]
    return figures.draw_heights_of_points(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        decoy={titles[name]: statistics.estimate_mean(points[name]) for name in titles},
        labels=[f"{number}: {name}" for number, name in enumerate(names, start=1)],
        shown_label=f"seed {experiment.seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_density(entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> Figure:
    height = _select(arrays["height_centre"], entry, experiment, arrays)
    quartiles = [experiment.quantiles.index(each) for each in QUARTILES]
    tools = _list_presented(entry, experiment, arrays)

    def select(values: Any) -> Any:  # before the first presentation and after each one that is drawn
        return np.concatenate([values[:, :1], _select(values[:, 1:], entry, experiment, arrays)], axis=1)

    return figures.draw_density_and_drop(
        quartiles=np.median(select(arrays["density_quantiles"])[..., quartiles], axis=0),
        mode=np.median(select(arrays["density_mode"]), axis=0),
        density_true=tools[0].components[0].material.density,
        drop=statistics.estimate_mean(statistics.compute_drop(height)),
        masses=np.array([tool.mass for tool in tools]),
        num_repeats=len(height),
    )


def _select(values: Any, entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> Any:
    """Selects the values of the drawn presentations, those with a motion, (R, n, ...)."""
    moves = experiment.layout.find_measured(Measure.DROP)
    return select_presentations(values[:, moves], arrays["presented"][:, moves], experiment.objects.groups[entry.of])


def _list_presented(entry: FigureEntry, experiment: PresentedExperiment, arrays: Arrays) -> list[Tool]:
    """Lists the objects among those drawn that were presented to the observer who is shown."""
    shown = _select(arrays["presented"], entry, experiment, arrays)[OBSERVER_SHOWN]
    return [experiment.tools[index] for index in shown]
