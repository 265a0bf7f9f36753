"""Lists the options that tools offer, as seen in pictures."""

from collections.abc import Sequence

import numpy as np

from affordance.choice.listed_options import list_grips
from affordance.choice.options import Option
from affordance.extensions.pixels.camera_sensor import CameraSensor, get_turning_stand
from affordance.extensions.pixels.seen_tool import observe_tool
from affordance.objects.tool import Tool


def list_seen_options(tools: Sequence[Tool], seed: int, stand: CameraSensor | None = None) -> list[Option]:
    """Lists the options of tools as seen in pictures from six sides.

    Args:
        tools: Tools to be observed.
        seed: Seed of the noise in pictures.
        stand: Camera with a stand for the tools; None for the turntable that the process shares.

    Raises:
        SeeingError: No features can be extracted from the pictures.
    """
    options: list[Option] = []
    for tool in tools:
        rng = np.random.default_rng([seed, *tool.name.encode()])
        options += list_grips(tool, observe_tool(tool, stand or get_turning_stand(), rng))
    return options
