"""Visual features of an object, and their measurement errors."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from affordance.arrays import Array
from affordance.files.constraints import CheckedFields, Setting, Within
from affordance.objects.appearance import PartAppearance
from affordance.objects.colour import Colour
from affordance.objects.inertia import Shape
from affordance.objects.striking_face import StrikingFace

_NONE = "the paper assumes none (IV-A)"


@dataclass(frozen=True)
class VisionError(CheckedFields):
    """Standard deviations of errors in measured features.

    Attributes:
        size: Standard deviation of each axis length, relative to the length.
        position: Standard deviation of each coordinate of a component's centre, [m].
        rotation: Standard deviation of a component's rotation about each axis, [rad].
    """

    size: Annotated[float, Within(0.0, 1.0), Setting("1", _NONE)] = 0.0
    position: Annotated[float, Within(0.0, 1.0), Setting("m", _NONE)] = 0.0
    rotation: Annotated[float, Within(0.0, 3.0), Setting("rad", _NONE)] = 0.0


@dataclass(frozen=True)
class ComponentFeatures:
    """Measured features of one component, with standard deviations (SD) of their errors."""

    colour: Colour  # red, green and blue in [0, 1]
    shape: Shape  # solid with the measured sizes (axis lengths), in the component's frame E
    X_TE: Array  # measured pose of the component in the tool frame T, (4, 4)
    size_sd: float = 0.0  # SD of each size, relative to the size
    position_sd: float = 0.0  # SD of each coordinate of the centre, [m]
    rotation_sd: float = 0.0  # SD of the rotation about each axis, [rad]
    colour_sd: float = 0.0  # SD of the colour in each direction of CIELAB; 0 if it is known exactly
    lightness_sd: float = 0.0  # SD of an additional error of lightness from illumination, in units of L*
    # Correlated errors from measurement in pictures, (G, 4, 4). Each is an affine map minus the identity, which
    # displaces the part's points in frame T by one SD.
    deformations: Array = field(default_factory=lambda: np.zeros((0, 4, 4)))
    strikes: tuple[StrikingFace, ...] = ()  # striking faces, known without error

    @property
    def appearance(self) -> PartAppearance:
        """Appearance of the component, for recognising the object."""
        x, y, z = (float(value) for value in self.X_TE[:3, 3])
        sizes = tuple(float(size) for size in self.shape.sizes)
        return PartAppearance(
            self.colour, sizes, (x, y, z), self.colour_sd, self.size_sd, self.position_sd, self.lightness_sd
        )
