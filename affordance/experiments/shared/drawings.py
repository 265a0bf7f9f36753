"""Figures, motions and replays of simulated observers."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from affordance.arrays import about
from affordance.experiments.shared.observers import OBSERVER_SHOWN
from affordance.objects.tool import Tool
from affordance.plant.load import load_arm
from affordance.reporting import figures
from affordance.reporting.formatting import label
from affordance.reporting.object_drawings import Drawing, draw_objects
from affordance.reporting.replay import Replay, Scene
from affordance.reporting.statistics import estimate_mean
from affordance.settings import Settings
from affordance.simulation.trial_record import TrialRecord


class Simulated(Protocol):
    """Simulation of a task with a gripped tool."""

    @property
    def record(self) -> TrialRecord:
        """Record of the arm's motion."""


def draw_density_and_drop(data: xr.Dataset, drop: xr.DataArray, tools: Sequence[Tool]) -> Figure:
    """Plots figure 3: believed ``density`` around each trial, and each observer's drop, [m]."""
    return figures.draw_density_and_drop(
        quartiles=data.density.median("observer").values,
        mode=data.density_mode.median("observer").values,
        density_true=tools[0].components[0].material.density,
        drop=estimate_mean(drop.values),
        masses=np.array([tool.mass for tool in tools]),
        num_repeats=data.sizes["observer"],
    )


def draw_heights(data: xr.Dataset, seed: int) -> Figure:
    """Plots figure 4: the height of each object over time, with the decoy last."""
    return figures.draw_heights(
        times=data.time.values,
        shown=data.height.values[OBSERVER_SHOWN],
        mean=estimate_mean(data.height.values),
        labels=data.trial.values.tolist(),
        shown_label=f"seed {seed}, observer {OBSERVER_SHOWN}",
        num_repeats=data.sizes["observer"],
    )


def draw_heights_of_points(data: xr.Dataset, points: Mapping[str, str], seed: int) -> Figure:
    """Plots figure 6: heights of each object's centre and of several points of the decoy.

    Args:
        data: Heights of all observers, [m]; the last trial is the decoy.
        points: Title of each point by the name of its variable; the first point is the centre.
        seed: Seed of the run, for the label.
    """
    centre, *_ = points
    return figures.draw_heights_of_points(
        times=data.time.values,
        shown=data[centre].values[OBSERVER_SHOWN],
        mean=estimate_mean(data[centre].values),
        decoy={title: estimate_mean(data[name].values[:, -1]) for name, title in points.items()},
        labels=[f"{number}: {name}" for number, name in enumerate(data.trial.values.tolist(), start=1)],
        shown_label=f"seed {seed}, observer {OBSERVER_SHOWN}",
        num_repeats=data.sizes["observer"],
    )


def draw_made_and_seen(tools: Sequence[Tool]) -> Figure:
    """Draws figure 5: the objects, and the decoy, which is last, with its apparent and its true materials."""
    *honest, decoy = tools
    drawings = [Drawing(tool, f"{number}: {label(tool.name)}") for number, tool in enumerate(honest, start=1)]
    name = f"{len(tools)}: {label(decoy.name)}"
    drawings += [Drawing(decoy, f"{name}, as it looks"), Drawing(decoy, f"{name}, as it is made", as_made=True)]
    return draw_objects(drawings, columns=2)


def add_motion(data: xr.Dataset, records: Sequence[TrialRecord], settings: Settings) -> xr.Dataset:
    """Adds the motion of the shown observer to the dataset of all observers."""
    whose = f"of observer {OBSERVER_SHOWN}"
    axes = ("trial", "time", "joint")
    return data.assign_coords(joint=load_arm(settings.arm).joint_names).assign(
        q=(axes, np.stack([each.q for each in records]), about("rad", f"joint angles {whose}")),
        v=(axes, np.stack([each.v for each in records]), about("rad/s", f"joint velocities {whose}")),
        tau=(
            axes,
            np.stack([each.tau for each in records]),
            about("N m", f"joint torques {whose} over the control period that ends at each time"),
        ),
    )


def label_motions(done: Mapping[str, Simulated], settings: Settings) -> xr.Dataset:
    """Builds a dataset of motions over grip, time and joint."""
    records = [each.record for each in done.values()]
    axes = ("grip", "time", "joint")
    return xr.Dataset(
        {
            "q": (
                axes,
                [each.q for each in records],
                about("rad", "joint angles, simulated with the true densities"),
            ),
            "v": (axes, [each.v for each in records], about("rad/s", "joint velocities")),
            "tau": (
                axes,
                [each.tau for each in records],
                about("N m", "joint torques over the control period that ends at each time"),
            ),
        },
        {
            "grip": list(done),
            "time": ("time", records[0].times, about("s", "time since the start")),
            "joint": load_arm(settings.arm).joint_names,
        },
    )


def replay_holds(tools: Sequence[Tool], records: Sequence[TrialRecord], settings: Settings, title: str) -> Replay:
    """Builds the replay of an observer's holds, with one scene per object."""
    pairs = zip(tools, records, strict=True)
    scenes = [
        Scene(tool, record.times, record.q, _describe(tool), height=record.height_centre) for tool, record in pairs
    ]
    return Replay(settings.arm, title, scenes)


def _describe(tool: Tool) -> str:
    """Describes an object by name and mass, and a decoy also by apparent and true material."""
    made, looks = (
        " and ".join(dict.fromkeys(getattr(part, name).name for part in tool.components))
        for name in ("material", "looks_like")
    )
    if made != looks:
        return f"{label(tool.name)}, {tool.mass:.2f} kg: looks like {looks}, is {made}"
    is_honest = all(part.material == part.looks_like for part in tool.components)
    return f"{label(tool.name)}, {tool.mass:.2f} kg{'' if is_honest else ': made otherwise than it looks'}"
