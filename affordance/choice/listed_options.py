"""Lists the options that tools offer, from one observation, from drawings or from pictures."""

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from affordance.arguments import Seed, check_kind, check_member, check_seed
from affordance.choice.options import Option
from affordance.objects.tool import Grip, Tool
from affordance.runs.random_streams import Stream
from affordance.vision.eye import measure_drawing, observe
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError

if TYPE_CHECKING:
    from affordance.vision.pixels.camera_sensor import CameraSensor


def list_options(
    tool: Tool,
    error: VisionError = VisionError(),
    seed: Seed = 0,
    feature_source: FeatureSource = FeatureSource.FEATURES,
) -> tuple[Option, ...]:
    """Observes a tool once and lists one option per grip.

    Args:
        tool: Tool to be observed.
        error: Standard deviations of the errors that are added to true features.
        seed: Seed of these errors, or of the noise in pictures.
        feature_source: Source of the features, as a member or its name: true features with errors, or pictures.

    Raises:
        BadArgumentError: An argument has the wrong type.
        SeeingError: No features can be extracted from the pictures.
    """
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some, each has options of its own")
    check_kind("error", error, VisionError)
    feature_source = check_member("feature_source", feature_source, FeatureSource)
    rng = np.random.default_rng(seed_observation(tool, seed))
    return _list_grips(tool, observe(tool, feature_source, error, rng))


def list_drawn_options(tools: Sequence[Tool]) -> list[Option]:
    """Lists the options of tools as drawn, with the errors of a drawing."""
    return [option for tool in tools for option in _list_grips(tool, measure_drawing(tool))]


def list_seen_options(tools: Sequence[Tool], seed: int, stand: "CameraSensor | None" = None) -> list[Option]:
    """Lists the options of tools as seen in pictures from six sides.

    Args:
        tools: Tools to be observed.
        seed: Seed of the noise in pictures.
        stand: Camera with a stand for the tools; None for the turntable that the process shares.

    Raises:
        SeeingError: No features can be extracted from the pictures.
    """
    # The camera and its pipeline are imported only if pictures are needed.
    seen = importlib.import_module("affordance.vision.pixels.seen_tool")
    options: list[Option] = []
    for tool in tools:
        rng = np.random.default_rng([seed, *tool.name.encode()])
        options += _list_grips(tool, seen.observe_tool(tool, stand or seen.get_turning_stand(), rng))
    return options


def seed_observation(tool: Tool, seed: Seed) -> list[int]:
    """Returns the seed for observing a tool to choose from, which differs between tools."""
    return [*check_seed(seed), Stream.OBSERVATION, *tool.name.encode()]


def _list_grips(tool: Tool, features: tuple[ComponentFeatures, ...]) -> tuple[Option, ...]:
    grips = tool.grips or (Grip("", np.eye(4)),)
    return tuple(Option(tool.name, grip.name, features, grip.X_TG) for grip in grips)
