"""Colour and depth pictures, and the camera that takes them.

Frame C is the camera's: Cx points right in the picture, Cy down, Cz along the view. A pixel (u, v), column and row,
is seen along the ray ((u - centre_x) / focal_length, (v - centre_y) / focal_length, 1) from Co. Depth is the
coordinate along Cz, [m], not the distance along the ray. A missing reading is 0.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

Labels = NDArray[np.int32]


@dataclass(frozen=True)
class Camera:
    """Pinhole camera with registered colour and depth pictures. A pixel shows the same point in both.

    The focal length, in pixels, is the same along both axes.
    """

    width: int = 640
    height: int = 480
    # Focal length of the first Kinect (57 by 43 degrees): 320 / tan(28.5 degrees).
    focal_length: float = 589.4

    @property
    def centre(self) -> tuple[float, float]:
        """Principal point, column and row."""
        return 0.5 * (self.width - 1), 0.5 * (self.height - 1)

    def compute_rays(self, pixels: Array) -> Array:
        """Computes the rays of N pixels, (N, 2), column and row, with z = 1, (N, 3)."""
        slopes = (pixels - np.array(self.centre)) / self.focal_length
        return np.column_stack([slopes, np.ones(len(pixels))])

    def project(self, points: Array) -> Array:
        """Projects N points in C, (N, 3), to pixels, column and row, (N, 2)."""
        pixels: Array = self.focal_length * points[:, :2] / points[:, 2:] + np.array(self.centre)
        return pixels


class Picture(NamedTuple):
    """Colour, (height, width, 3), uint8, and depth along Cz, (height, width), [m]. Depth is 0 without a reading."""

    colour: NDArray[np.uint8]
    depth: Array
