"""Eye of an observer: the function that gives the features of an object that is looked at.

Their source is either the true features with errors of given standard deviation, or colour and depth pictures of the
object on its stand and nothing else.
"""

import importlib
from collections.abc import Callable

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError, measure_features

# Function from an object and a random generator of the errors to the features of its components.
type Eye = Callable[[Tool, np.random.Generator], tuple[ComponentFeatures, ...]]


def open_eye(source: FeatureSource, error: VisionError) -> Eye:
    """Returns the eye that settings name; arguments as for ``observe``."""
    return lambda tool, rng: observe(tool, source, error, rng)


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
    # The camera and its pipeline are loaded for pictures only.
    see = importlib.import_module("affordance.vision.pixels.seen_tool").see
    features: tuple[ComponentFeatures, ...] = see(tool, rng)
    return features
