"""Eye of an observer: the function that gives the features of an object that is looked at."""

import importlib
from collections.abc import Callable

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError, measure_features

# Function from an object and a random generator of the errors to the features of its components.
type Eye = Callable[[Tool, np.random.Generator], tuple[ComponentFeatures, ...]]


def open_eye(source: FeatureSource, error: VisionError) -> Eye:
    """Returns the eye that settings name.

    The camera and its pipeline are loaded for pictures only; whoever is given true features does without them.

    Args:
        source: Source of the features: the true ones with an error, or pictures.
        error: Standard deviations of the errors, if the source is the true features.
    """
    if source is FeatureSource.FEATURES:
        return lambda tool, rng: measure_features(tool, error, rng)
    observe = importlib.import_module("affordance.vision.observe").observe
    return lambda tool, rng: observe(tool, source, error, rng)
