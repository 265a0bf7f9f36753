"""Measures the visual features of an object.

The paper assumes an algorithm that measures the three-dimensional sizes of ellipsoids in pictures. Here the features
are either the true features plus random errors (zero by default), or they are measured in colour and depth pictures
of the object on its stand.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import scipy

from affordance.exceptions import BadArgumentError, show_value
from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures, VisionError

# Function that measures the features of an object's components. The random generator is for errors.
type Eye = Callable[[Tool, np.random.Generator], tuple[ComponentFeatures, ...]]


def observe(
    tool: Tool, eye: Eye | None, error: VisionError, rng: np.random.Generator
) -> tuple[ComponentFeatures, ...]:
    """Measures an object's features with an eye, or adds random errors to the true features if there is no eye.

    Raises:
        SeeingError: The features are not visible in a picture.
    """
    return measure_features(tool, error, rng) if eye is None else eye(tool, rng)


def check_eye(name: str, value: Any) -> Eye | None:
    """Checks that a value is an eye or None, and returns it.

    Raises:
        BadArgumentError: The value is anything else.
    """
    if value is None or callable(value):
        return cast(Eye | None, value)
    raise BadArgumentError(name, "", f"is {show_value(value)}, must be a function of an object and a generator")


def measure_features(tool: Tool, error: VisionError, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Adds normally distributed errors to a tool's true features.

    Sizes are multiplied by the exponential of their error, so they remain positive.
    """
    features = []
    for component in tool.components:
        sizes, X_TE = component.shape.sizes, np.array(component.X_TE)
        shape = component.shape.with_sizes(sizes * np.exp(error.size * rng.standard_normal(len(sizes))))
        X_TE[:3, 3] += error.position * rng.standard_normal(3)
        turn = scipy.spatial.transform.Rotation.from_rotvec(error.rotation * rng.standard_normal(3))
        X_TE[:3, :3] = turn.as_matrix() @ X_TE[:3, :3]
        sds = (error.size, error.position, error.rotation)
        colour = component.looks_like.colour
        features.append(ComponentFeatures(colour, shape, X_TE, *sds, strikes=component.strikes))
    return tuple(features)


def measure_drawing(tool: Tool) -> tuple[ComponentFeatures, ...]:
    """Returns the features in a tool's drawing. Their errors are errors of each part's volume and position."""
    features = []
    seen = measure_features(tool, VisionError(), np.random.default_rng(0))
    for part, drawn in zip(seen, tool.components, strict=True):
        deformations = np.zeros((4, 4, 4))
        strain = drawn.volume_sd / 3.0
        deformations[0, :3, :3] = strain * np.eye(3)
        deformations[0, :3, 3] = -strain * part.X_TE[:3, 3]
        deformations[1:, :3, 3] = drawn.place_sd * np.eye(3)
        features.append(replace(part, deformations=deformations))
    return tuple(features)
