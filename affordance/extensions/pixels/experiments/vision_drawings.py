"""Figures of the vision experiment: pictures of objects with their detected parts, and errors of detection."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from affordance.choice.listed_options import seed_observation
from affordance.exceptions import SeeingError
from affordance.extensions.pixels.camera_figures import CameraView, draw_calibration, draw_camera_views
from affordance.extensions.pixels.camera_sensor import get_camera_sensor
from affordance.extensions.pixels.experiments.random_objects import take_picture
from affordance.files.frames import save_frame
from affordance.objects.tool import Tool


def draw_pictures(seed: int, numbered: Sequence[tuple[int, str]]) -> Figure:
    """Draws the pictures of random objects, each with its number and a note."""
    views = []
    for number, note in numbered:
        name, picture = f"object {number}", take_picture(seed, number)
        try:
            views.append(CameraView(name, picture, get_camera_sensor().detect_parts(picture), note))
        except SeeingError:
            views.append(CameraView(name, picture, None, note))
    return draw_camera_views(views)


def draw_uncommon(tools: Sequence[Tool], seed: int) -> Figure:
    """Draws the pictures of the uncommon objects from which they are ranked."""
    sensor = get_camera_sensor()
    views = []
    for tool in tools:
        picture = sensor.take_image(tool, np.random.default_rng(seed_observation(tool, seed)))
        views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
    return draw_camera_views(views)


def draw_errors(data: xr.Dataset, count: int, targets: Mapping[str, float]) -> Figure:
    """Draws the sizes of the errors of the first ``count`` objects, and all errors of mass over their stated SDs.

    ``targets`` are the bounds of the median errors: of visible axes, the axis along the view, and mass.
    """
    errors = {}
    for label, name in zip(targets, ("visible_error", "depth_error", "mass_error"), strict=True):
        values = data[name].isel(object=slice(count)).values
        errors[label] = np.abs(values[np.isfinite(values)])
    claimed = data.mass_deviation.values
    return draw_calibration(errors=errors, targets=targets, claimed=claimed[np.isfinite(claimed)])


def save_picture(seed: int, number: int, reason: str, folder: Path) -> None:
    """Saves the picture of an object that was not detected, or not detected correctly."""
    save_frame(SeeingError(reason, *take_picture(seed, number)), folder / "frames", f"object_{number:05d}")
