"""Options of a choice: objects in grips, described by their observed features."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from affordance.arguments import check_pose
from affordance.arrays import Array
from affordance.objects.tool import Tool, Weighing
from affordance.vision.features import ComponentFeatures


@dataclass(frozen=True)
class Option:
    """Object in a grip.

    Attributes:
        object_name: Name of the object; all options of an object have the same parts.
        grip: Name of the grip; empty if there is only one.
        features: Observed features of the object's components, in the object's frame T, the same for all its grips.
        X_TG: Pose of the grip G, which coincides with the hand frame, in the object's frame, shape (4, 4).
        weighings: Measured masses of the object, or of some of its parts, which are indices of features.
    """

    object_name: str
    grip: str
    features: tuple[ComponentFeatures, ...]
    X_TG: Array
    weighings: tuple[Weighing, ...] = ()

    def __post_init__(self) -> None:
        """Stores a read-only copy of the pose; raises a BadArgumentError if it is not a rigid transform."""
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))

    def __repr__(self) -> str:
        return f"Option({self.name}, {len(self.features)} parts)"

    @property
    def name(self) -> str:
        """Name of the object, with the grip if it has more than one."""
        return f"{self.object_name} by {self.grip}" if self.grip else self.object_name

    @property
    def gripped(self) -> tuple[ComponentFeatures, ...]:
        """Features of the object's components, posed relative to the hand."""
        X_GT = np.linalg.inv(self.X_TG)
        return tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.features)


def add_weighings(options: Sequence[Option], tools: Sequence[Tool]) -> list[Option]:
    """Adds the weighings of tools to their options; those of parts only if the option distinguishes all parts."""
    by_name = {tool.name: tool for tool in tools}
    weighed = []
    for option in options:
        tool = by_name[option.object_name]
        is_distinguished = len(option.features) == len(tool.components)
        weighings = tuple(each for each in tool.weighings if is_distinguished or not each.parts)
        weighed.append(replace(option, weighings=weighings))
    return weighed
