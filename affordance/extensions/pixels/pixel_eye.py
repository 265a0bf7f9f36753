"""Visual sensor that measures features in camera images."""

import time
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from affordance.extensions.pixels.camera_figures import CameraView, draw_camera_views
from affordance.extensions.pixels.camera_sensor import get_camera_sensor
from affordance.extensions.pixels.rig import render
from affordance.extensions.pixels.seen_tool import see
from affordance.files.model_folder import MODELS
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import Tool
from affordance.runs.random_streams import Stream
from affordance.vision.features import ComponentFeatures


class PixelEye:
    """Visual sensor that measures features in colour and depth images."""

    caption = (
        "Images of each object before it is grasped: colour, depth (white where there is no reading), detected "
        "parts, and outlines of the ellipsoids fitted to them. Features are measured in such images only."
    )

    def __call__(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Measures the features of a tool in camera images."""
        return see(tool, rng)

    def __eq__(self, other: object) -> bool:
        return type(other) is PixelEye

    def __hash__(self) -> int:
        return hash(PixelEye)

    def to_plain(self) -> str:
        """Returns the name for files."""
        return "pixels"

    def draw(self, tools: Sequence[Tool], seed: int) -> Figure:
        """Takes an image of each tool, and plots it with the detected parts."""
        sensor = get_camera_sensor()
        views = []
        for index, tool in enumerate(tools):
            picture = sensor.take_image(tool, np.random.default_rng([seed, Stream.SHOWN, index]))
            views.append(CameraView(tool.name, picture, sensor.detect_parts(picture)))
        return draw_camera_views(views, sensor.rig.camera)


PIXELS = PixelEye()


def check_renderer() -> str:
    """Renders an image, and describes the required time."""
    tools = load_tools(MODELS / "tools" / "weight.yaml", load_materials(MODELS / "materials.yaml"))
    start = time.perf_counter()
    render(tools[0])
    return f"works, a picture takes {1e3 * (time.perf_counter() - start):.0f} ms"
