"""Figures of vision: camera images with detections, and errors of detected features."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import norm

from affordance.arrays import Array
from affordance.extensions.pixels.pipeline import Detection, draw_outline
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.rig import DEFAULT_RIG
from affordance.reporting.figures import MARKERS, OBJECT_COLOURS, tidy

# Margin around the object in cropped images, [pixels].
_ROOM = 25
_TITLE_WIDTH = 150  # [characters]


class CameraView(NamedTuple):
    """Camera image of an object, with detection and note if there are any."""

    title: str
    picture: Picture
    detection: Detection | None
    note: str = ""


def draw_camera_views(views: Sequence[CameraView], camera: Camera = DEFAULT_RIG.camera) -> Figure:
    """Plots colour image, depth image, parts, and outlines over the colour image, one row per observation."""
    heights = [2.4, *[2.1] * (len(views) - 1)]  # the first row has the headings
    figure = Figure(figsize=(12.0, sum(heights)))
    rows = figure.subfigures(len(views), 1, squeeze=False, height_ratios=heights)[:, 0]
    for row, view in zip(rows, views, strict=True):
        title = f"{view.title}: {view.note}" if view.note else view.title
        row.suptitle(textwrap.fill(title, _TITLE_WIDTH), x=0.005, horizontalalignment="left", fontsize=10)
        _draw_camera_view(row.subplots(1, 4), view, camera)
    for axes, heading in zip(rows[0].axes, ("colour", "depth", "parts", "fitted ellipsoids"), strict=True):
        axes.set_title(heading, fontsize=10)
    return figure


def _draw_camera_view(row: NDArray[np.object_], view: CameraView, camera: Camera) -> None:
    window = _find_window(view)
    colour, depth = view.picture.colour[window], view.picture.depth[window]
    shown: list[Axes] = list(row)
    shown[0].imshow(colour)
    read = depth[depth > 0.0]
    shown[1].imshow(np.where(depth > 0.0, depth, np.nan), cmap="viridis_r", vmin=read.min(), vmax=read.max())
    parts = np.full((*depth.shape, 3), 245, dtype=np.uint8)
    shown[3].imshow(colour)
    if view.detection is not None:
        for number, fit in enumerate(view.detection.fits):
            tone = OBJECT_COLOURS[number % len(OBJECT_COLOURS)]
            parts[view.detection.segmentation.labels[window] == number] = [
                int(tone[i : i + 2], 16) for i in (1, 3, 5)
            ]
            x, y = draw_outline(fit.ellipsoid, camera).T - np.array([[window[1].start], [window[0].start]])
            shown[3].plot(x, y, color="#FFFFFF", linewidth=2.2)
            shown[3].plot(x, y, color=tone, linewidth=1.2)
    shown[2].imshow(parts)
    for axes in shown:
        axes.set_xticks([])
        axes.set_yticks([])


def _find_window(view: CameraView) -> tuple[slice, slice]:
    """Finds rows and columns of a window around the object, with an aspect ratio of at least 4:3.

    Without a detection, the window is the whole image.
    """
    height, width = view.picture.depth.shape
    if view.detection is None:
        return slice(0, height), slice(0, width)
    rows, columns = np.nonzero(view.detection.segmentation.labels >= 0)
    half_height = 0.5 * float(np.ptp(rows)) + _ROOM
    half_width = max(0.5 * float(np.ptp(columns)) + _ROOM, 4.0 / 3.0 * half_height)
    half_height = max(half_height, 0.45 * half_width)
    x, y = 0.5 * float(columns.min() + columns.max()), 0.5 * float(rows.min() + rows.max())
    return (
        slice(max(0, int(y - half_height)), min(height, int(y + half_height))),
        slice(max(0, int(x - half_width)), min(width, int(x + half_width))),
    )


def draw_calibration(*, errors: dict[str, Array], targets: Mapping[str, float], claimed: Array) -> Figure:
    """Plots errors of detected features, and the calibration of their uncertainty.

    Args:
        errors: Absolute relative errors, by feature.
        targets: Largest allowed median error, by feature.
        claimed: Errors of predicted masses divided by their estimated standard deviations.
    """
    figure = Figure(figsize=(11.0, 4.4))
    left, right = figure.subplots(1, 2)
    for k, (label, values) in enumerate(errors.items()):
        colour = OBJECT_COLOURS[k % len(OBJECT_COLOURS)]
        left.plot(100.0 * np.sort(values), np.linspace(0.0, 1.0, len(values)), color=colour, label=label)
        left.plot(100.0 * targets[label], 0.5, MARKERS[k % len(MARKERS)], color=colour)
    left.axhline(0.5, color="#000000", linewidth=0.8, linestyle=":")
    left.plot([], [], MARKERS[0], color="#FFFFFF", markeredgecolor="#000000", label="largest allowed median")
    left.set(
        xscale="log",
        xlim=(0.01, 100.0),
        ylim=(0.0, 1.02),
        xlabel="error (%)",
        ylabel="proportion of cases with at most this error",
    )
    left.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    levels = np.linspace(0.0, 1.0, 101)[1:-1]
    covered = [(np.abs(claimed) <= norm.ppf(0.5 + 0.5 * level)).mean() for level in levels]
    right.plot(levels, levels, ":", color="#000000", label="exact")
    right.plot(levels, covered, color=OBJECT_COLOURS[0], label=f"predicted mass, {len(claimed)} objects")
    right.plot([0.9, 0.9], [0.85, 0.95], color=OBJECT_COLOURS[2], linewidth=3.0, label="target")
    right.set(xlabel="stated probability of the interval", ylabel="proportion of intervals with the true value")
    right.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)
    tidy(left, right)
    return figure
