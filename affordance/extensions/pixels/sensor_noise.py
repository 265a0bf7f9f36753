"""Noise model of a common RGB-D camera.

Depth noise was measured by Nguyen, Izadi and Lovell for the first Kinect (2012, Modeling Kinect sensor noise for
improved 3D reconstruction and tracking, 3DIMPVT), at depth z, [m], and angle theta between surface and image, [rad]:

    axial SD   = 0.0012 + 0.0019 (z - 0.4)^2 + 0.0001 / sqrt(z) (theta / (pi/2 - theta))^2      [m]
    lateral SD = 0.8 + 0.035 theta / (pi/2 - theta)                                             [pixels]

Colour has photon noise, whose variance is proportional to the signal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.extensions.pixels.rgbd import Camera, Picture

# Largest systematic error of the stand's depth, from rounding in the renderer or from calibration, [m].
STAND_ERROR = 1e-3
# Surface angle for lateral noise at the outline, [rad]. It is the angle on a sphere with a radius of 30 pixels, at
# one pixel (the lateral SD) inside its outline.
_RIM_ANGLE = float(np.radians(75.0))


@dataclass(frozen=True)
class SensorNoise:
    """Noise parameters of a colour and depth image (see docs/decisions/0015-vision-from-pixels.md)."""

    # Factor of the axial and lateral standard deviations of depth; 0 for a perfect sensor.
    depth_scale: float = 1.0
    # Signal-to-noise ratio of a saturated colour pixel, infinite for a perfect sensor; 40 is excellent (ISO 12232).
    signal_to_noise: float = 40.0
    # Largest surface angle of depth readings, [rad], which is the largest angle measured by Nguyen et al.
    max_angle: float = float(np.radians(80.0))

    def compute_axial_sd(self, depth: Array, angle: Array) -> Array:
        """Computes the axial standard deviation of depth, [m], from depths, [m], and surface angles, [rad]."""
        tilt = angle / (0.5 * np.pi - angle)
        return self.depth_scale * (0.0012 + 0.0019 * (depth - 0.4) ** 2 + 0.0001 / np.sqrt(depth) * tilt**2)

    def compute_lateral_sd(self, angle: Array) -> Array:
        """Computes the lateral standard deviation of depth readings, [pixels], from surface angles, [rad]."""
        return self.depth_scale * (0.8 + 0.035 * angle / (0.5 * np.pi - angle))

    @property
    def outline_shift(self) -> float:
        """Inward shift of the outline in a depth image, [pixels].

        Lateral noise shifts the edge of the surface outwards by SD / sqrt(2 pi), and the edge of the background
        inwards by SD / sqrt(2 pi). The SDs differ, because only the surface is strongly inclined near the outline.
        """
        surface, behind = self.compute_lateral_sd(np.array([_RIM_ANGLE, 0.0]))
        return float((surface - behind) / np.sqrt(2.0 * np.pi))

    @property
    def outline_sd(self) -> float:
        """Standard deviation of the position of an edge between two neighbouring pixels, [pixels].

        The mean square error of an edge position in a row of pixels is SD / sqrt(pi), plus 1/12 from rounding. It is
        increased because an outline has 4 / pi edges per pixel of its length.
        """
        surface, behind = self.compute_lateral_sd(np.array([_RIM_ANGLE, 0.0]))
        return float(np.sqrt((0.5 * (surface + behind) / np.sqrt(np.pi) + 1.0 / 12.0) * 4.0 / np.pi))

    def add_to(self, picture: Picture, camera: Camera, rng: np.random.Generator) -> Picture:
        """Adds sensor noise to an image.

        Depth is read at a point that is displaced by lateral noise, and has the axial noise of that point.
        """
        return Picture(self._disturb_colour(picture.colour, rng), self._disturb_depth(picture.depth, camera, rng))

    def _disturb_colour(self, colour: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
        signal = colour / np.float32(255.0)
        noise = rng.standard_normal(colour.shape, dtype=np.float32)
        noise = noise * np.sqrt(signal) / np.float32(self.signal_to_noise)
        return np.rint(255.0 * np.clip(signal + noise, 0.0, 1.0)).astype(np.uint8)

    def _disturb_depth(self, depth: Array, camera: Camera, rng: np.random.Generator) -> Array:
        angle = measure_angles(depth, camera)
        lateral = self.compute_lateral_sd(np.minimum(angle, self.max_angle))
        height, width = depth.shape
        rows, columns = np.indices(depth.shape)
        noise = rng.standard_normal((3, height, width), dtype=np.float32)
        rows = np.clip(np.rint(rows + lateral * noise[0]).astype(np.intp), 0, height - 1)
        columns = np.clip(np.rint(columns + lateral * noise[1]).astype(np.intp), 0, width - 1)
        there, turned = depth[rows, columns], angle[rows, columns]
        readable = (there > 0.0) & (turned <= self.max_angle)
        safe, bounded = np.where(readable, there, 1.0), np.where(readable, turned, 0.0)
        return np.where(readable, there + self.compute_axial_sd(safe, bounded) * noise[2], 0.0)


def measure_angles(depth: Array, camera: Camera) -> Array:
    """Computes the angle between surface and image plane at each pixel, (height, width), [rad].

    The depth image must be noise-free.

    The smaller of the slopes to both neighbours along each axis is used, so that depth steps at outlines have no
    effect.
    """
    slopes = []
    for axis in (0, 1):
        step = np.abs(np.diff(depth, axis=axis))
        edge = np.full_like(np.take(depth, [0], axis=axis), np.inf)
        after, before = np.concatenate([step, edge], axis=axis), np.concatenate([edge, step], axis=axis)
        slopes.append(np.minimum(after, before) * camera.focal_length / np.where(depth > 0.0, depth, 1.0))
    angles: Array = np.arctan(np.hypot(*slopes))
    return angles
