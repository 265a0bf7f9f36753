"""Options of a choice: objects with their observed features, each in one grip."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from affordance.arguments import check_pose
from affordance.arrays import Array
from affordance.objects.inertia import parameters_from_pseudo_inertia
from affordance.objects.tool import Tool, Weighing
from affordance.vision.features import ComponentFeatures

# Largest difference in positions and sizes of parts in the hand between equivalent grips, [m]. Drawings and meshes
# are symmetric to this accuracy.
_ALIKE = 1e-4


@dataclass(frozen=True)
class Option:
    """Object in a grip.

    Attributes:
        object_name: Name of the object; all options of an object have the same parts.
        grip: Name of the grip; empty if there is only one.
        features: Observed features of the object's parts in the object's frame T, equal for all grips of the object.
        X_TG: Pose of the grip frame G, which coincides with the hand frame, in T, shape (4, 4).
        weighings: Measured masses of the object or of some of its parts, which are given as indices of features.
        alike: Names of other grips that are equivalent by symmetry.
    """

    object_name: str
    grip: str
    features: tuple[ComponentFeatures, ...]
    X_TG: Array
    weighings: tuple[Weighing, ...] = ()
    alike: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Stores a read-only copy of the pose.

        Raises:
            BadArgumentError: The pose is not a rigid transform.
        """
        object.__setattr__(self, "X_TG", check_pose("X_TG", self.X_TG))

    def __repr__(self) -> str:
        return f"Option({self.name}, {len(self.features)} parts)"

    @property
    def name(self) -> str:
        """Name of the object, followed by the name of the grip if there are several."""
        return f"{self.object_name} by {self.grip}" if self.grip else self.object_name

    @property
    def gripped(self) -> tuple[ComponentFeatures, ...]:
        """Features of the object's parts, posed relative to the hand."""
        X_GT = np.linalg.inv(self.X_TG)
        return tuple(replace(part, X_TE=X_GT @ part.X_TE) for part in self.features)


def add_weighings(options: Sequence[Option], tools: Sequence[Tool]) -> list[Option]:
    """Adds the weighings of tools to their options.

    Weighings of parts are added only if the features of the option distinguish all parts.
    """
    by_name = {tool.name: tool for tool in tools}
    weighed = []
    for option in options:
        tool = by_name[option.object_name]
        is_distinguished = len(option.features) == len(tool.components)
        weighings = tuple(each for each in tool.weighings if is_distinguished or not each.parts)
        weighed.append(replace(option, weighings=weighings))
    return weighed


def merge_alike(options: Sequence[Option]) -> list[Option]:
    """Merges options of an object whose grips are equivalent by symmetry.

    Equivalent grips have the same parts and striking faces in the hand, and thus the same cost in any task. The first
    option remains.
    """
    merged: dict[str, tuple[Option, list[Array]]] = {}
    for option in options:
        form = _describe_form(option.gripped)
        for name, (one, other) in merged.items():
            if one.object_name == option.object_name and _is_one_form(form, other):
                merged[name] = replace(one, alike=(*one.alike, option.grip)), other
                break
        else:
            merged[option.name] = option, form
    return [option for option, _ in merged.values()]


def _describe_form(parts: Sequence[ComponentFeatures]) -> list[Array]:
    """Describes an object in the hand by an array of parts with their colours, and an array of striking faces."""
    rows, faces = [], []
    for part in parts:
        J_E, turned = part.shape.unit_pseudo_inertia(), part.X_TE.copy()
        turned[:3, 3] = 0.0
        m, *first = parameters_from_pseudo_inertia(part.X_TE @ J_E @ part.X_TE.T)[:4]
        moments = parameters_from_pseudo_inertia(turned @ J_E @ turned.T)[4:] / m
        # Division by twice the root converts differences in second moments to differences in lengths.
        lengths = moments / (2.0 * np.sqrt(moments[:3].sum()))
        rows.append([*(np.array(first) / m), *lengths, np.cbrt(m), *part.colour])
        R_TE, p_TE = part.X_TE[:3, :3], part.X_TE[:3, 3]
        faces += [[*(p_TE + R_TE @ face.p_EQ), *(R_TE @ face.normal_E)] for face in part.strikes]
    return [np.array(rows), np.array(faces).reshape(-1, 6)]


def _is_one_form(one: Sequence[Array], other: Sequence[Array]) -> bool:
    """Returns True if two descriptions have the same rows in any order."""
    for rows, others in zip(one, other, strict=True):
        left = list(others)
        for row in rows:
            near = [k for k, each in enumerate(left) if np.allclose(row, each, rtol=0.0, atol=_ALIKE)]
            if not near:
                return False
            del left[near[0]]
        if left:
            return False
    return True
