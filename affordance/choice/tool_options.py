"""Options that tools with grips offer, known by their drawings or by pictures of them."""

from collections.abc import Sequence

import numpy as np

from affordance.choice.options import Option
from affordance.objects.tool import Tool
from affordance.vision.eye import measure_drawing
from affordance.vision.pixels.camera_sensor import CameraSensor, get_turning_stand
from affordance.vision.pixels.seen_tool import observe_tool


def list_seen_options(tools: Sequence[Tool], stand: CameraSensor, seed: int) -> list[Option]:
    """Lists the options from pictures of each tool from six sides.

    Raises:
        SeeingError: The features cannot be extracted from the pictures.
    """
    options = []
    for tool in tools:
        features = observe_tool(tool, stand, np.random.default_rng([seed, *tool.name.encode()]))
        options += [Option(tool.name, grip.name, features, grip.X_TG) for grip in tool.grips]
    return options


def list_drawn_options(tools: Sequence[Tool]) -> list[Option]:
    """Lists the options from the tools' drawings, with the errors of a drawing."""
    return [Option(tool.name, grip.name, measure_drawing(tool), grip.X_TG) for tool in tools for grip in tool.grips]


def list_tool_options(tools: Sequence[Tool], *, by_sight: bool, seed: int) -> list[Option]:
    """Lists the options from pictures or drawings."""
    return list_seen_options(tools, get_turning_stand(), seed) if by_sight else list_drawn_options(tools)
