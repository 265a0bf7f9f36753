"""Colour and depth images, and the pinhole camera.

In the camera frame C, Cx points right in the image, Cy down, and Cz along the optical axis. The ray of a pixel (u,
v), column and row, has the direction ((u - centre_x) / focal_length, (v - centre_y) / focal_length, 1). Depth is the
coordinate along Cz, [m], not the distance along the ray. Missing readings are 0.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

Labels = NDArray[np.int32]


@dataclass(frozen=True)
class Camera:
    """Pinhole camera with registered colour and depth images.

    The focal length, [pixels], is the same along both axes.
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
    """Registered colour and depth image."""

    colour: NDArray[np.uint8]  # (height, width, 3)
    depth: Array  # along Cz, (height, width), [m]; 0 without a reading
