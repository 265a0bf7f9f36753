"""Observation of an object's features by the source that the settings name.

The source is either the true features with errors of given standard deviation, or colour and depth pictures of the
object on its stand and nothing else: one picture of an object made of ellipsoids, two of any other, which is turned
over in between.
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
        tool: Object to be observed.
        source: Source of the features: the true ones with an error, or pictures.
        error: Standard deviations of the errors, if the source is the true features.
        rng: Random generator of the errors, or of the noise of the pictures.

    Raises:
        SeeingError: The features cannot be extracted from the pictures.
    """
    if source is FeatureSource.FEATURES:
        return measure_features(tool, error, rng)
    try:
        if needs_turning(tool):
            return observe_tool(tool, get_turning_stand(), rng)
        return get_camera_sensor().observe(tool, rng)
    except SeeingError as failure:
        raise type(failure)(f"{tool.name}: {failure.reason}", failure.colour, failure.depth) from failure
