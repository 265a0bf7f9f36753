"""Features of an object, from the source that the settings name.

Either the true features with a stated error, or features from colour and depth pictures of the object on its stand
and from nothing else: one picture of an object that is made of ellipsoids, two of any other, which is turned over in
between. All come out of the same port.
"""

import numpy as np

from affordance.exceptions import SeeingError
from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError, measure_features
from affordance.vision.pixels.camera_sensor import get_camera_sensor
from affordance.vision.pixels.seen_tool import observe_tool
from affordance.vision.pixels.turning_stand import get_turning_stand, needs_turning


def observe(
    tool: Tool, source: FeatureSource, error: VisionError, rng: np.random.Generator
) -> tuple[ComponentFeatures, ...]:
    """Measures the features of an object.

    Args:
        tool: The object.
        source: Whether its features are measured with an error, or detected in a picture.
        error: Of features that are measured.
        rng: Draws the errors of the measurement, or the noise of the picture.

    Raises:
        SeeingError: The picture does not show what is needed.
    """
    if source is FeatureSource.FEATURES:
        return measure_features(tool, error, rng)
    try:
        if needs_turning(tool):
            return observe_tool(tool, get_turning_stand(), rng)
        return get_camera_sensor().observe(tool, rng)
    except SeeingError as failure:
        raise type(failure)(f"{tool.name}: {failure.reason}", failure.colour, failure.depth) from failure
