"""Lists the options of tools from an observation or a drawing."""

from collections.abc import Sequence

import numpy as np

from affordance.arguments import Seed, check_kind, check_seed
from affordance.choice.options import Option
from affordance.objects.tool import Grip, Tool
from affordance.runs.random_streams import Stream
from affordance.vision.eye import Eye, check_eye, measure_drawing, observe
from affordance.vision.features import ComponentFeatures, VisionError


def list_options(
    tool: Tool,
    error: VisionError = VisionError(),
    seed: Seed = 0,
    eye: Eye | None = None,
) -> tuple[Option, ...]:
    """Observes a tool, and returns one option per grip.

    Args:
        tool: Tool to be observed.
        error: Standard deviations of errors that are added to the true features.
        seed: Seed of these errors, or of the errors of ``eye``.
        eye: Function that measures the features; None for true features with errors.

    Raises:
        BadArgumentError: An argument has the wrong type.
        SeeingError: No features can be extracted from the pictures.
    """
    check_kind("tool", tool, Tool, "load_tools(PATH) reads some, each has options of its own")
    check_kind("error", error, VisionError)
    eye = check_eye("eye", eye)
    rng = np.random.default_rng(seed_observation(tool, seed))
    return list_grips(tool, observe(tool, eye, error, rng))


def list_drawn_options(tools: Sequence[Tool]) -> list[Option]:
    """Lists the options of tools from their drawings, with the errors of drawings."""
    return [option for tool in tools for option in list_grips(tool, measure_drawing(tool))]


def seed_observation(tool: Tool, seed: Seed) -> list[int]:
    """Returns the seed for the observation of a tool, which differs between tools."""
    return [*check_seed(seed), Stream.OBSERVATION, *tool.name.encode()]


def list_grips(tool: Tool, features: tuple[ComponentFeatures, ...]) -> tuple[Option, ...]:
    """Returns one option per grip of a tool, with given features."""
    grips = tool.grips or (Grip("", np.eye(4)),)
    return tuple(Option(tool.name, grip.name, features, grip.X_TG) for grip in grips)
