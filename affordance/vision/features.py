"""Visual features of an object, with their errors.

The paper assumes an algorithm that recovers the three-dimensional sizes of ellipsoids from pictures. Here the true
features are passed on with errors of given standard deviation, zero by default.
"""

import enum
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.files.constraints import CheckedFields, Setting, Within
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour
from affordance.objects.inertia import Shape
from affordance.objects.tool import StrikingFace, Tool

_NONE = "the paper assumes none (IV-A)"
# What drawings are off by: parity of mass within 0.3 %, of centres of mass within 0.15 mm, as on all twenty tools
# (docs/tools.md says what is blind and what is not).
CAD_VOLUME_SD, CAD_PLACE_SD = 4e-3, 2e-4


@dataclass(frozen=True)
class VisionError(CheckedFields):
    """Standard deviations of the errors of measured features.

    Attributes:
        size: Standard deviation of each axis length, as a fraction of that length.
        position: Standard deviation of each coordinate of a component's centre, [m].
        rotation: Standard deviation of the rotation about each axis, [rad].
    """

    size: Annotated[float, Within(0.0, 1.0), Setting("1", _NONE)] = 0.0
    position: Annotated[float, Within(0.0, 1.0), Setting("m", _NONE)] = 0.0
    rotation: Annotated[float, Within(0.0, 3.0), Setting("rad", _NONE)] = 0.0


class FeatureSource(enum.Enum):
    """Source of an object's features."""

    FEATURES = "features"  # true features with measurement errors (paper, IV-A)
    PIXELS = "pixels"  # colour and depth pictures only


@dataclass(frozen=True)
class ComponentFeatures:
    """Features of one component.

    Attributes:
        colour: Colour of the component, red, green and blue in [0, 1].
        shape: Solid with the measured sizes (axis lengths).
        X_TE: Measured pose of the component, shape (4, 4).
        size_sd: Standard deviation of each size's error, as a fraction of that size.
        position_sd: Standard deviation of each coordinate's error, [m].
        rotation_sd: Standard deviation of the error about each axis, [rad].
        colour_sd: Standard deviation of the colour's error in each direction of CIELAB; 0 if it is known exactly.
        lightness_sd: Standard deviation of a further error of the colour's lightness, as from the illumination, in
            units of L*.
        deformations: Further errors, each the displacement of the part's points in T by one standard deviation, an
            affine map less the identity, shape (G, 4, 4): what a picture leaves undetermined, with its correlations.
        strikes: Striking faces of the component, known without measurement.
    """

    colour: Colour
    shape: Shape
    X_TE: Array
    size_sd: float = 0.0
    position_sd: float = 0.0
    rotation_sd: float = 0.0
    colour_sd: float = 0.0
    lightness_sd: float = 0.0
    deformations: Array = field(default_factory=lambda: np.zeros((0, 4, 4)))
    strikes: tuple[StrikingFace, ...] = ()

    @property
    def appearance(self) -> PartAppearance:
        """Appearance of the component, by which the object is recognised."""
        x, y, z = (float(value) for value in self.X_TE[:3, 3])
        sizes = tuple(float(size) for size in self.shape.sizes)
        return PartAppearance(
            self.colour, sizes, (x, y, z), self.colour_sd, self.size_sd, self.position_sd, self.lightness_sd
        )


def measure_features(tool: Tool, error: VisionError, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures a tool: its true features plus normally distributed errors.

    Sizes are multiplied by the exponential of their error, so that they stay positive.
    """
    features = []
    for component in tool.components:
        sizes = component.shape.sizes
        X_TE = np.array(component.X_TE)
        sizes = sizes * np.exp(error.size * rng.standard_normal(len(sizes)))
        X_TE[:3, 3] += error.position * rng.standard_normal(3)
        X_TE[:3, :3] = Rotation.from_rotvec(error.rotation * rng.standard_normal(3)).as_matrix() @ X_TE[:3, :3]
        features.append(
            ComponentFeatures(
                component.looks_like.colour,
                component.shape.with_sizes(sizes),
                X_TE,
                error.size,
                error.position,
                error.rotation,
                strikes=component.strikes,
            )
        )
    return tuple(features)


def measure_drawing(tool: Tool) -> tuple[ComponentFeatures, ...]:
    """The tool as it was drawn, with what a drawing is off by: a part's volume, and its place along each axis."""
    features = []
    for part in measure_features(tool, VisionError(), np.random.default_rng(0)):
        deformations = np.zeros((4, 4, 4))
        strain = CAD_VOLUME_SD / 3.0
        deformations[0, :3, :3] = strain * np.eye(3)
        deformations[0, :3, 3] = -strain * part.X_TE[:3, 3]
        deformations[1:, :3, 3] = CAD_PLACE_SD * np.eye(3)
        features.append(replace(part, deformations=deformations))
    return tuple(features)
