"""Objects in grips, as the eye sees them."""

from dataclasses import dataclass, replace

import numpy as np

from affordance.arrays import Array
from affordance.objects.tool import Grip, Tool
from affordance.random_streams import Stream
from affordance.settings import Settings
from affordance.vision.features import ComponentFeatures, FeatureSource, VisionError
from affordance.vision.observe import observe


@dataclass(frozen=True)
class Option:
    """An object in a grip.

    Attributes:
        object_name: Which object it is; options of one thing are made of the very same parts.
        grip: Which end is in the hand; empty if there is no choice.
        features: What the eye says of its components, in the object's own frame T, the same for all its grips.
        X_TG: Pose of the grip G, which coincides with the hand, in the object, shape (4, 4).
    """

    object_name: str
    grip: str
    features: tuple[ComponentFeatures, ...]
    X_TG: Array

    @property
    def name(self) -> str:
        """The thing, and its grip if there is a choice."""
        return f"{self.object_name} by {self.grip}" if self.grip else self.object_name

    @property
    def gripped(self) -> tuple[ComponentFeatures, ...]:
        """What the eye says of its components, posed relative to the hand."""
        X_GT = np.linalg.inv(self.X_TG)
        return tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.features)


def seed_observation(tool: Tool, seed: int) -> list[int]:
    """Seed of the one look at a tool that is chosen about, so that each has noise of its own."""
    return [seed, Stream.OBSERVATION, *tool.name.encode()]


def list_options(
    tool: Tool,
    error: VisionError = VisionError(),
    seed: int = 0,
    feature_source: FeatureSource = FeatureSource.FEATURES,
) -> tuple[Option, ...]:
    """Looks at a tool once and lists the ways of holding it.

    Args:
        tool: The tool.
        error: How well the eye measures, where it is told the features.
        seed: Determines the errors of the eye, or the noise of the picture.
        feature_source: Whether the features are told, or seen in a picture.

    Raises:
        SeeingError: The picture does not show what is needed.
    """
    features = observe(
        tool,
        Settings(vision_error=error, feature_source=feature_source),
        np.random.default_rng(seed_observation(tool, seed)),
    )
    grips = tool.grips or (Grip("", np.eye(4)),)
    return tuple(Option(tool.name, grip.name, features, grip.X_TG) for grip in grips)
