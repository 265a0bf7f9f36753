"""What an experiment's objects looked like to the camera, for its section of the report."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from affordance.objects.tool import Tool
from affordance.random_streams import Stream
from affordance.reporting import figures
from affordance.reporting.camera_figures import CameraView, draw_camera_views
from affordance.reporting.report import Picture, Section
from affordance.settings import Settings
from affordance.vision.features import FeatureSource
from affordance.vision.pixels.camera_sensor import get_camera_sensor


def add_camera_views(section: Section, folder: Path, tools: Sequence[Tool], settings: Settings, seed: int) -> Section:
    """Adds a picture of what was seen of each object to a section, if features come from pictures at all.

    Args:
        section: What the experiment reports.
        folder: Receives ``seen.png`` and ``seen.svg``.
        tools: The objects.
        settings: Say where features come from.
        seed: Root of every random draw.
    """
    if settings.feature_source is FeatureSource.FEATURES:
        return section
    sensor = get_camera_sensor()
    views = []
    for index, tool in enumerate(tools):
        picture = sensor.take_image(tool, np.random.default_rng([seed, Stream.SHOWN, index]))
        views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
    figures.save_figure(draw_camera_views(views, sensor.rig.camera), folder, "seen")
    caption = (
        "What the camera saw of each object before the hand took it: colour, depth (white where nothing was read), "
        "parts made out, and outlines of the ellipsoids fitted to them. Features came from such pictures, no others."
    )
    return section._replace(pictures=[*section.pictures, Picture("seen.png", caption)])
