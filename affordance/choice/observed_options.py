"""Listing of the options that a tool offers, from one observation of the tool."""

import numpy as np

from affordance.arguments import Seed, check_kind, check_member, check_seed
from affordance.choice.options import Option
from affordance.objects.tool import Grip, Tool
from affordance.runs.random_streams import Stream
from affordance.vision.eye import observe
from affordance.vision.features import FeatureSource, VisionError


def seed_observation(tool: Tool, seed: Seed) -> list[int]:
    """Returns the seed of the observation of a tool to choose, so that each tool has noise of its own."""
    return [*check_seed(seed), Stream.OBSERVATION, *tool.name.encode()]


def list_options(
    tool: Tool,
    error: VisionError = VisionError(),
    seed: Seed = 0,
    feature_source: FeatureSource = FeatureSource.FEATURES,
) -> tuple[Option, ...]:
    """Observes a tool once and lists the ways of holding it.

    Args:
        tool: Tool to be observed.
        error: Standard deviations of the errors, if the source is the true features.
        seed: Seed of the errors of the measurement, or of the noise of the pictures.
        feature_source: Source of the features, as a member or its name: the true ones with an error, or pictures.

    Raises:
        BadArgumentError: An argument is of the wrong kind.
        SeeingError: The features cannot be extracted from the pictures.
    """
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some, each has options of its own")
    check_kind("error", error, VisionError)
    feature_source = check_member("feature_source", feature_source, FeatureSource)
    rng = np.random.default_rng(seed_observation(tool, seed))
    features = observe(tool, feature_source, error, rng)
    grips = tool.grips or (Grip("", np.eye(4)),)
    return tuple(Option(tool.name, grip.name, features, grip.X_TG) for grip in grips)
