"""What pictures say of an object of any form: looks, and of each look a solid with the error of having seen it.

Three ways to a solid: columns between two sides; columns behind one side; and for comparison an ellipsoid a look, as
the eye fits it to objects that are made of such. What a camera cannot see, a hollow or a core of another material,
is part of the stated error, whose size is that found on ten tools (docs/decisions/0024-real-tools.md).
"""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.column_solid import ColumnSolid
from affordance.objects.inertia import Ellipsoid, Shape
from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.columns import View, build_columns, build_mirrored_columns
from affordance.vision.pixels.looks import COLOUR_SD, Look, find_looks
from affordance.vision.pixels.rig import Rig
from affordance.vision.pixels.sensor_noise import SensorNoise
from affordance.vision.pixels.silhouette import find_silhouette
from affordance.vision.pixels.surface import measure_surface
from affordance.vision.pixels.turning_stand import Photograph, TurningStand, find_presented_pose


class Method(enum.Enum):
    """How a solid is made of what is seen."""

    TWO_VIEWS = "two_views"  # columns between both sides
    ONE_VIEW = "one_view"  # columns behind one side
    ELLIPSOIDS = "ellipsoid"  # an ellipsoid a look, from one side


class SolidError(NamedTuple):
    """How far off the solids of a method are.

    Attributes:
        bias: Mean of the logarithm of volume seen by volume true.
        log_volume_sd: Standard deviation of that logarithm about its mean.
        place_sd: Standard deviation of each coordinate of a part's centroid, as a fraction of its length along it.
    """

    bias: float
    log_volume_sd: float
    place_sd: float


# Over the ten learning tools at their true densities. Standard deviations are such that a normal distribution's 90 %
# interval ends where the 90th percentile of the errors' sizes is: most of the error of two views comes from one tool
# that is hollow, so that the root of their mean square would be too small for 90 % and too large for the rest.
ERRORS: Mapping[Method, SolidError] = {
    Method.TWO_VIEWS: SolidError(bias=0.0, log_volume_sd=0.15, place_sd=0.011),
    Method.ONE_VIEW: SolidError(bias=0.36, log_volume_sd=0.36, place_sd=0.056),
    Method.ELLIPSOIDS: SolidError(bias=1.11, log_volume_sd=0.83, place_sd=0.05),
}


class SeenTool(NamedTuple):
    """What was made of the pictures.

    Attributes:
        looks: The colours of its parts.
        views: Surface and looks of each picture.
        stand_height: Of the stand's top along Pz in the first view, [m].
    """

    looks: tuple[Look, ...]
    views: tuple[View, ...]
    stand_height: float

    def compute_features(self, method: Method, X_TP: Array) -> tuple[ComponentFeatures, ...]:
        """Features of the parts in T, by the pose in which the object was presented, shape (4, 4)."""
        error = ERRORS[method]
        if method is Method.TWO_VIEWS:
            solids = build_columns(*self.views)
        else:
            solids = build_mirrored_columns(self.views[0], self.stand_height)
        parts = [
            (self.looks[number], *_stretch(solid, np.exp(-error.bias)).centre()) for number, solid in solids.items()
        ]
        if method is not Method.ELLIPSOIDS:
            return tuple(describe_solid(look, solid, place_at(p_PEo), X_TP, error) for look, solid, p_PEo in parts)
        return tuple(
            describe_solid(look, *find_equal_ellipsoid(solid, p_PEo), X_TP, error) for look, solid, p_PEo in parts
        )


def detect_tool(photographs: Sequence[Photograph], rig: Rig, noise: SensorNoise) -> SeenTool:
    """Finds the object and its looks in pictures from one side or two.

    Raises:
        SeeingError: What cannot be seen, by its kind; see find_silhouette.
    """
    surfaces = [
        measure_surface(picture, find_silhouette(picture, rig.height, noise), rig.camera)
        for picture, _ in photographs
    ]
    found = find_looks(surfaces)
    views = tuple(
        View(surface, labels, rig.camera, photograph.X_PC)
        for surface, labels, photograph in zip(surfaces, found.labels, photographs, strict=True)
    )
    return SeenTool(found.looks, views, float(photographs[0].X_PC[2, 3]) - rig.height)


def observe_tool(
    tool: Tool, stand: TurningStand, rng: np.random.Generator, method: Method = Method.TWO_VIEWS
) -> tuple[ComponentFeatures, ...]:
    """Looks at an object on the stand and returns the features of its parts.

    Raises:
        SeeingError: What cannot be seen, by its kind.
    """
    photographs = stand.take_pictures(tool, rng)
    used = photographs if method is Method.TWO_VIEWS else photographs[:1]
    seen = detect_tool(used, stand.rig, stand.noise)
    return give_strikes(seen.compute_features(method, find_presented_pose(tool)), tool)


def describe_solid(look: Look, shape: Shape, X_PE: Array, X_TP: Array, error: SolidError) -> ComponentFeatures:
    """Features of a part in T, its errors as deformations: of its thickness along Pz, and of its place along P.

    Args:
        look: Its colour.
        shape: Its solid, with Eo in its centroid.
        X_PE: Its pose in the presented object, shape (4, 4).
        X_TP: Pose in which that is presented, shape (4, 4).
        error: How far off the solid may be.
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


def find_equal_ellipsoid(solid: ColumnSolid, p_PEo: Array) -> tuple[Ellipsoid, Array]:
    """The ellipsoid with the second moments of a solid about its centroid, and its pose X_PE, shape (4, 4).

    A solid ellipsoid's second moments are m a^2 / 5. Its volume is not that of the solid: whoever believes in
    ellipsoids sees nothing else.

    Args:
        solid: The solid, with Eo in its centroid and axes along those of P.
        p_PEo: Its centroid, shape (3,), [m].
    """
    J = solid.unit_pseudo_inertia()
    squares, axes = np.linalg.eigh(J[:3, :3] / J[3, 3])
    a, b, c = (float(size) for size in np.sqrt(5.0 * squares[::-1]))
    X_PE = place_at(p_PEo)
    X_PE[:3, :3] = axes[:, ::-1]
    X_PE[:3, 2] *= np.sign(np.linalg.det(axes[:, ::-1]))
    return Ellipsoid((a, b, c)), X_PE


def place_at(p_PEo: Array) -> Array:
    """The pose of a frame at a point with the axes of P, shape (4, 4)."""
    X_PE = np.eye(4)
    X_PE[:3, 3] = p_PEo
    return X_PE


def _stretch(solid: ColumnSolid, factor: float) -> ColumnSolid:
    """The solid with columns longer by a factor, about their middles."""
    middle = solid.ends.mean(axis=1, keepdims=True)
    return ColumnSolid(solid.places, solid.areas, middle + factor * (solid.ends - middle))


def give_strikes(features: Sequence[ComponentFeatures], tool: Tool) -> tuple[ComponentFeatures, ...]:
    """Gives the faces that are made to strike, which the eye is told, to the parts whose surfaces are nearest."""
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
    """How far a point lies beyond a part as seen from its centroid, negative within, [m]."""
    p_EQ = X_TE[:3, :3].T @ (p_TQ - X_TE[:3, 3])
    return float(np.linalg.norm(p_EQ) - p_EQ @ shape.find_support(p_EQ) / np.linalg.norm(p_EQ))
