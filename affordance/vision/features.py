"""Visual features of an object, with their errors.

The paper assumes an algorithm that recovers the three-dimensional sizes of ellipsoids from pictures. Here the true
features are handed over with a stated error, which by default is none.
"""

import enum
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.arrays import Array
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour
from affordance.objects.inertia import Shape
from affordance.objects.tool import Tool


class VisionError(NamedTuple):
    """Standard deviations of measured features.

    Attributes:
        size: Of each axis length, as a fraction of it.
        position: Of each coordinate of a component's centre, [m].
        rotation: About each axis, [rad].
    """

    size: float = 0.0
    position: float = 0.0
    rotation: float = 0.0


class FeatureSource(enum.Enum):
    """Where the features of an object come from."""

    FEATURES = "features"  # the object itself, with the error of measuring them (paper, IV-A)
    PIXELS = "pixels"  # a colour and depth picture of it, and nothing else


@dataclass(frozen=True)
class ComponentFeatures:
    """Features of one component.

    Attributes:
        colour: Its colour, red, green and blue in [0, 1].
        shape: Its solid with the sizes (axis lengths) as measured.
        X_TE: Its measured pose, shape (4, 4).
        size_sd: Standard deviation of each size's error, as a fraction of that size.
        position_sd: Standard deviation of each coordinate's error, [m].
        rotation_sd: Standard deviation of the error about each axis, [rad].
        colour_sd: Standard deviation of the colour's error in each direction of CIELAB; 0 if it is known exactly.
        deformations: Further errors, each an affine map of points in T by which the part is off, one standard
            deviation of it, less the identity, shape (G, 4, 4): what a picture leaves open, correlations included.
    """

    colour: Colour
    shape: Shape
    X_TE: Array
    size_sd: float = 0.0
    position_sd: float = 0.0
    rotation_sd: float = 0.0
    colour_sd: float = 0.0
    deformations: Array = field(default_factory=lambda: np.zeros((0, 4, 4)))

    @property
    def appearance(self) -> PartAppearance:
        """What of it tells which object it belongs to."""
        x, y, z = (float(value) for value in self.X_TE[:3, 3])
        sizes = tuple(float(size) for size in self.shape.sizes)
        return PartAppearance(self.colour, sizes, (x, y, z), self.colour_sd, self.size_sd, self.position_sd)


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
            )
        )
    return tuple(features)
