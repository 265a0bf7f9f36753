"""Figures and trajectories of simulated presentations, by how a protocol wants them drawn."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from affordance.experiments.definition import OBSERVER_SHOWN, Arrays
from affordance.experiments.shared.trajectories import HEIGHTS, label_heights, label_motions
from affordance.files.netcdf import LabelledArray
from affordance.objects.tool import Tool
from affordance.protocols.measured import select_presentations
from affordance.protocols.number_entries import FigureEntry
from affordance.protocols.object_entries import ProtocolObjects
from affordance.reporting import figures, statistics
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.simulation.trial_record import TrialRecord


def draw_figures(
    entries: Mapping[str, FigureEntry],
    objects: ProtocolObjects,
    arrays: Arrays,
    quantiles: Sequence[float],
    seed: int,
) -> dict[str, Callable[[], Figure]]:
    """What draws each figure of a protocol.

    Args:
        entries: How they are drawn.
        objects: Those of the protocol.
        arrays: Of all observers.
        quantiles: Those of beliefs that are kept.
        seed: That of the run, for labels.
    """
    draw = {
        "objects": lambda entry: _draw_objects(entry, objects),
        "heights": lambda entry: _draw_heights(entry, objects, arrays, seed),
        "heights of points": lambda entry: _draw_points(entry, objects, arrays, seed),
        "density and drop": lambda entry: _draw_density(entry, objects, arrays, quantiles),
    }
    return {name: partial(draw[entry.draw], entry) for name, entry in entries.items() if entry.draw in draw}


def label_results(
    arrays: Arrays, quantiles: Sequence[float], records: Sequence[TrialRecord]
) -> dict[str, LabelledArray]:
    """Labels what is kept of all observers, and the motions of the one that is shown."""
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


def _draw_objects(entry: FigureEntry, objects: ProtocolObjects) -> Figure:
    decoys = [] if entry.decoy is None else objects.select(entry.decoy)
    drawings = []
    for number, tool in enumerate(objects.select(entry.of), start=1):
        if tool not in decoys:
            drawings.append(Drawing(tool, f"{number}: {tool.name}"))
            continue
        drawings.append(Drawing(tool, f"{number}: {tool.name}, as it looks"))
        drawings.append(Drawing(tool, f"{number}: {tool.name}, as it is made", as_made=True))
    return draw_objects(drawings, columns=2)


def _draw_heights(entry: FigureEntry, objects: ProtocolObjects, arrays: Arrays, seed: int) -> Figure:
    height, names = _select(arrays["height_centre"], entry, objects, arrays)
    return figures.draw_heights(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        labels=names,
        shown_label=f"seed {seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_points(entry: FigureEntry, objects: ProtocolObjects, arrays: Arrays, seed: int) -> Figure:
    height, names = _select(arrays["height_centre"], entry, objects, arrays)
    decoy = FigureEntry(draw=entry.draw, of=entry.decoy or entry.of)
    points = {name: _select(arrays[name], decoy, objects, arrays)[0][:, -1] for name in HEIGHTS}
    titles = {"height_centre": "geometric centre", "height_grip": "grip", "height_com": "true centre of mass"}
    return figures.draw_heights_of_points(
        times=arrays["times"][0],
        shown=height[OBSERVER_SHOWN],
        mean=statistics.estimate_mean(height),
        decoy={titles[name]: statistics.estimate_mean(points[name]) for name in titles},
        labels=[f"{number}: {name}" for number, name in enumerate(names, start=1)],
        shown_label=f"seed {seed}, observer {OBSERVER_SHOWN}",
        num_repeats=len(height),
    )


def _draw_density(entry: FigureEntry, objects: ProtocolObjects, arrays: Arrays, quantiles: Sequence[float]) -> Figure:
    height, _ = _select(arrays["height_centre"], entry, objects, arrays)
    moments = np.concatenate([[0], 1 + np.flatnonzero(np.isin(arrays["presented"][0], objects.groups[entry.of]))])
    quartiles = [list(quantiles).index(each) for each in (0.25, 0.5, 0.75)]
    tools = _list_presented(entry, objects, arrays)
    return figures.draw_density_and_drop(
        quartiles=np.median(arrays["density_quantiles"][:, moments][..., quartiles], axis=0),
        mode=np.median(arrays["density_mode"][:, moments], axis=0),
        density_true=tools[0].components[0].material.density,
        drop=statistics.estimate_mean(statistics.compute_drop(height)),
        masses=np.array([tool.mass for tool in tools]),
        num_repeats=len(height),
    )


def _select(values: Any, entry: FigureEntry, objects: ProtocolObjects, arrays: Arrays) -> tuple[Any, list[str]]:
    """Values of the presentations that are drawn, (R, n, ...), and the names of their objects."""
    chosen = select_presentations(values, arrays["presented"], objects.groups[entry.of])
    return chosen, [tool.name for tool in _list_presented(entry, objects, arrays)]


def _list_presented(entry: FigureEntry, objects: ProtocolObjects, arrays: Arrays) -> list[Tool]:
    """The objects that the observer who is shown was presented with, of those that are drawn."""
    group = objects.groups[entry.of]
    return [objects.tools[index] for index in arrays["presented"][OBSERVER_SHOWN] if index in group]
