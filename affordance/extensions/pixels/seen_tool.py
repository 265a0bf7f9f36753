"""Measurement of appearance and shape of arbitrary objects in camera images.

A solid consists of columns between the surfaces in two opposite views, minus hollows that are visible in four further
views. The stated errors include invisible features such as cavities or cores of another material. They were
determined with ten tools (docs/decisions/0015-vision-from-pixels.md compares other reconstruction methods).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.choice.listed_options import list_grips
from affordance.choice.options import Option
from affordance.exceptions import SeeingError
from affordance.extensions.pixels.camera_sensor import (
    UPRIGHT,
    CameraSensor,
    Photograph,
    find_presented_pose,
    get_camera_sensor,
    get_turning_stand,
    needs_turning,
)
from affordance.extensions.pixels.columns import Side, View, build_columns, carve
from affordance.extensions.pixels.looks import COLOUR_SD, Look, find_looks
from affordance.extensions.pixels.rig import Rig
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.extensions.pixels.surface import Surface, find_silhouette, measure_surface
from affordance.files.constraints import Setting
from affordance.objects.array_solids import ColumnSolid
from affordance.objects.inertia import Shape
from affordance.objects.tool import Tool
from affordance.objects.tool_entries import build_pose
from affordance.vision.features import ComponentFeatures

_MEASURED = "errors over the ten learning tools at their true densities (docs/decisions/0015-vision-from-pixels.md)"


class SolidError(NamedTuple):
    """Error model of reconstructed solids.

    Attributes:
        bias: Mean of log(estimated volume / true volume).
        log_volume_sd: Standard deviation of log(estimated volume / true volume).
        place_sd: Standard deviation of each coordinate of a part's centroid, as a fraction of the part's length along
            that axis.
    """

    bias: Annotated[float, Setting("1", _MEASURED)]
    log_volume_sd: Annotated[float, Setting("1", _MEASURED)]
    place_sd: Annotated[float, Setting("1", _MEASURED)]


# Standard deviations match the 90th percentile of absolute errors to a normal distribution. The root mean square
# would be too small at 90 % and too large otherwise, because a single hollow tool dominates it.
ERROR = SolidError(bias=0.0, log_volume_sd=0.15, place_sd=0.011)


class SeenTool(NamedTuple):
    """Appearances and views of an object."""

    looks: tuple[Look, ...]
    views: tuple[View, ...]  # one view, or two opposite views
    sides: tuple[Side, ...] = ()  # views along further axes

    def compute_features(self, X_TP: Array) -> tuple[ComponentFeatures, ...]:
        """Computes the features of the parts in T, given the presented pose X_TP, (4, 4)."""
        parts = self.centre(carve(build_columns(*self.views), self.sides), ERROR)
        return tuple(describe_solid(look, solid, build_pose(p_PEo), X_TP, ERROR) for look, solid, p_PEo in parts)

    def centre(
        self, solids: Mapping[int, ColumnSolid], error: SolidError
    ) -> Iterator[tuple[Look, ColumnSolid, Array]]:
        """Yields each appearance with its bias-corrected solid about the centroid Eo, and p_PEo, (3,), [m]."""
        for number, solid in solids.items():
            middle = solid.ends.mean(axis=1, keepdims=True)
            ends = middle + np.exp(-error.bias) * (solid.ends - middle)
            yield self.looks[number], *ColumnSolid(solid.places, solid.areas, ends).centre()


def detect_tool(
    photographs: Sequence[Photograph],
    rig: Rig,
    noise: SensorNoise,
    sides: Sequence[tuple[Photograph, Photograph]] = (),
) -> SeenTool:
    """Measures appearance and shape of an object in images from one, two or more sides.

    Errors are as in ``find_silhouette``.
    """
    surfaces = [_measure(each, rig, noise) for each in photographs]
    found = find_looks(surfaces)
    views = tuple(
        View(surface, labels, rig.camera, photograph.X_PC)
        for surface, labels, photograph in zip(surfaces, found.labels, photographs, strict=True)
    )
    seen = []
    for R, pair in zip(UPRIGHT, sides, strict=bool(sides)):
        above, below = (_measure_form(each, rig, noise) for each in pair)
        seen.append(Side(R, (above, below)))
    return SeenTool(found.looks, views, tuple(seen))


def _measure(photograph: Photograph, rig: Rig, noise: SensorNoise) -> Surface:
    mask = find_silhouette(photograph.picture, photograph.stand_depth, noise)
    return measure_surface(photograph.picture, mask, rig.camera)


def _measure_form(photograph: Photograph, rig: Rig, noise: SensorNoise) -> View:
    surface = _measure(photograph, rig, noise)
    return View(surface, np.zeros(surface.mask.shape, dtype=np.int32), rig.camera, photograph.X_PC)


def observe_tool(tool: Tool, stand: CameraSensor, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures the features of an object's parts on the stand. Errors are as in ``detect_tool``."""
    photographs, sides = stand.take_pictures(tool, rng), stand.take_sides(tool, rng)
    seen = detect_tool(photographs, stand.rig, stand.noise, sides)
    return give_strikes(seen.compute_features(find_presented_pose(tool)), tool)


def see(tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures features in one image of an object composed of ellipsoids, or six images of any other object."""
    try:
        if needs_turning(tool):
            return observe_tool(tool, get_turning_stand(), rng)
        return get_camera_sensor().observe(tool, rng)
    except SeeingError as failure:
        raise type(failure)(f"{tool.name}: {failure.reason}", failure.colour, failure.depth) from failure


def describe_solid(look: Look, shape: Shape, X_PE: Array, X_TP: Array, error: SolidError) -> ComponentFeatures:
    """Converts a solid to features in T, with errors of its thickness along Pz and of its position.

    Args:
        look: Appearance.
        shape: Solid about its centroid Eo.
        X_PE: Pose of the solid in P, (4, 4).
        X_TP: Presented pose, (4, 4).
        error: Error model.
    """
    deformations = np.zeros((4, 4, 4))
    deformations[0, 2, 2] = error.log_volume_sd
    deformations[0, 2, 3] = -error.log_volume_sd * X_PE[2, 3]
    for axis, direction in enumerate(np.eye(3)):
        along = X_PE[:3, :3].T @ direction
        deformations[1 + axis, axis, 3] = (
            error.place_sd * along @ (shape.find_support(along) - shape.find_support(-along))
        )
    return ComponentFeatures(
        look.colour,
        shape,
        X_TP @ X_PE,
        colour_sd=COLOUR_SD,
        lightness_sd=look.lightness_sd,
        deformations=X_TP @ deformations @ np.linalg.inv(X_TP),
    )


def give_strikes(features: Sequence[ComponentFeatures], tool: Tool) -> tuple[ComponentFeatures, ...]:
    """Assigns the known striking faces of a tool to the closest parts."""
    seen = list(features)
    for part in tool.components:
        for face in part.strikes:
            p_TQ, normal_T = face.express(part.X_TE)
            nearest = min(range(len(seen)), key=lambda k: _measure_gap(seen[k].shape, seen[k].X_TE, p_TQ))
            X_ET = np.linalg.inv(seen[nearest].X_TE)
            moved = replace(face, p_EQ=X_ET[:3, :3] @ p_TQ + X_ET[:3, 3], normal_E=X_ET[:3, :3] @ normal_T)
            seen[nearest] = replace(seen[nearest], strikes=(*seen[nearest].strikes, moved))
    return tuple(seen)


def _measure_gap(shape: Shape, X_TE: Array, p_TQ: Array) -> float:
    """Computes the distance of a point from the surface of a part along the line from its centroid, [m].

    The distance is negative inside the part.
    """
    p_EQ = X_TE[:3, :3].T @ (p_TQ - X_TE[:3, 3])
    return float(np.linalg.norm(p_EQ) - p_EQ @ shape.find_support(p_EQ) / np.linalg.norm(p_EQ))


def list_seen_options(tools: Sequence[Tool], seed: int, stand: CameraSensor | None = None) -> list[Option]:
    """Observes tools in images from six sides, and lists their options.

    Args:
        tools: Tools.
        seed: Seed of the image noise.
        stand: Camera with stand; None for the shared camera of this process.

    Raises:
        SeeingError: No features can be extracted from the images.
    """
    options: list[Option] = []
    for tool in tools:
        rng = np.random.default_rng([seed, *tool.name.encode()])
        options += list_grips(tool, observe_tool(tool, stand or get_turning_stand(), rng))
    return options
