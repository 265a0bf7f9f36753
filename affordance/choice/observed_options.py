"""Listing the options that a tool offers, from one observation of it."""

import numpy as np

from affordance.choice.options import Option
from affordance.objects.tool import Grip, Tool
from affordance.random_streams import Stream
from affordance.vision.features import FeatureSource, VisionError
from affordance.vision.observe import observe


def seed_observation(tool: Tool, seed: int) -> list[int]:
    """Seed of the one observation of a tool that is chosen about, so that each has noise of its own."""
    return [seed, Stream.OBSERVATION, *tool.name.encode()]


def list_options(
    tool: Tool,
    error: VisionError = VisionError(),
    seed: int = 0,
    feature_source: FeatureSource = FeatureSource.FEATURES,
) -> tuple[Option, ...]:
    """Observes a tool once and lists the ways of holding it.

    Args:
        tool: The tool.
        error: Of features that are measured.
        seed: Determines the errors of the measurement, or the noise of the picture.
        feature_source: Whether features are measured, or detected in a picture.

    Raises:
        SeeingError: The picture does not show what is needed.
    """
    rng = np.random.default_rng(seed_observation(tool, seed))
    features = observe(tool, feature_source, error, rng)
    grips = tool.grips or (Grip("", np.eye(4)),)
    return tuple(Option(tool.name, grip.name, features, grip.X_TG) for grip in grips)
