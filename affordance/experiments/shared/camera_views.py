"""Camera pictures of an experiment's objects, for its section of the report."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from affordance.objects.tool import Tool
from affordance.reporting.camera_figures import CameraView, draw_camera_views
from affordance.runs.random_streams import Stream
from affordance.vision.pixels.camera_sensor import get_camera_sensor


def draw_camera_views_of(tools: Sequence[Tool], seed: int) -> Figure:
    """Takes a picture of each tool and draws the detected parts in it; seed is the root of the camera's noise."""
    sensor = get_camera_sensor()
    views = []
    for index, tool in enumerate(tools):
        picture = sensor.take_image(tool, np.random.default_rng([seed, Stream.SHOWN, index]))
        views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
    return draw_camera_views(views, sensor.rig.camera)
