"""The eye: what is measured of an object presented, by the sight the settings name.

Either true features with a stated error (features.py), or features from pictures of the object on its stand
(pixels/), and from nothing else: one picture of an object that is made of ellipsoids, two of any other, which is
turned over in between. All come out of the same port.
"""

import numpy as np

from affordance.exceptions import SeeingError
from affordance.objects.tool import Tool
from affordance.settings import Settings
from affordance.vision.features import ComponentFeatures, FeatureSource, measure_features
from affordance.vision.pixels.camera_sensor import get_camera_sensor
from affordance.vision.pixels.seen_tool import observe_tool
from affordance.vision.pixels.turning_stand import get_turning_stand, needs_turning


def observe(tool: Tool, settings: Settings, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures an object as the settings say.

    Args:
        tool: The object.
        settings: Whether features are measured or seen in pictures, and with which error they are measured.
        rng: Draws the errors of the measurement, or the noise of the picture.

    Raises:
        SeeingError: The picture does not show what is needed.
    """
    if settings.feature_source is FeatureSource.FEATURES:
        return measure_features(tool, settings.vision_error, rng)
    try:
        if needs_turning(tool):
            return observe_tool(tool, get_turning_stand(), rng)
        return get_camera_sensor().observe(tool, rng)
    except SeeingError as error:
        raise type(error)(f"{tool.name}: {error.reason}", error.colour, error.depth) from error
