"""Options of a choice: objects in grips, by their observed features."""

from dataclasses import dataclass, replace

import numpy as np

from affordance.arguments import check_pose
from affordance.arrays import Array
from affordance.vision.features import ComponentFeatures


@dataclass(frozen=True)
class Option:
    """An object in a grip.

    Attributes:
        object_name: Which object it is; options of one object share its parts.
        grip: Which end is in the hand; empty if there is no choice.
        features: Observed features of its components, in the object's own frame T, the same for all its grips.
        X_TG: Pose of the grip G, which coincides with the hand, in the object, shape (4, 4).
    """

    object_name: str
    grip: str
    features: tuple[ComponentFeatures, ...]
    X_TG: Array

    def __post_init__(self) -> None:
        """Checks the pose, and keeps a read-only copy of it.

        Raises:
            BadArgumentError: The pose scales or mirrors.
        """
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))

    def __repr__(self) -> str:
        return f"Option({self.name}, {len(self.features)} parts)"

    @property
    def name(self) -> str:
        """The object, and its grip if there is a choice."""
        return f"{self.object_name} by {self.grip}" if self.grip else self.object_name

    @property
    def gripped(self) -> tuple[ComponentFeatures, ...]:
        """Features of its components, posed relative to the hand."""
        X_GT = np.linalg.inv(self.X_TG)
        return tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.features)
