"""Camera above a stand that takes images of an object from one or more sides.

P is the frame of the presented object: the frame of its first grip, or T without grips, with axes permuted so that Pz
is normal to the plane in which the object lies flat. For the second view, the object is turned over about Px. Its
lowest point touches the stand. Its pose is known because the hand places it there.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.pixels.pipeline import Detection, detect_parts
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.rig import DEFAULT_RIG, Rig, render
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool, find_box
from affordance.vision.features import ComponentFeatures

# Twice the resolution of the first Kinect at two thirds of the distance, so that a pixel covers half a millimetre.
# Lateral noise is constant in pixels and therefore smaller in millimetres by the same factor.
TURNING_RIG = Rig(camera=Camera(width=1280, height=960, focal_length=1178.8), height=0.6)
# Number of cached noise-free images of 3 MB each, or 13 MB on the turning stand. This is enough for an experiment.
_KEPT = 12
# Rotation by 180 degrees about Px.
_TURN = np.diag([1.0, -1.0, -1.0, 1.0])
# Pz is the axis of the smallest extent instead of Gz if this extent is below this fraction of the extent along Gz.
_FLATTER = 0.9
# Rotations that point Px upwards (first) and Py upwards (second).
UPRIGHT = (np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))


class Photograph(NamedTuple):
    """Image of a presented object."""

    picture: Picture
    X_PC: Array  # pose of the camera, (4, 4)
    stand_depth: float  # depth of the stand, [m]


class CameraSensor:
    """Camera for objects on a stand, with a cache of noise-free images."""

    def __init__(self, rig: Rig = DEFAULT_RIG) -> None:
        """Creates a camera with the noise of a common RGB-D camera, which can be changed with ``noise``."""
        self.rig = rig
        self.noise = SensorNoise()
        self._renderings: dict[tuple[object, ...], Picture] = {}

    def render(self, tool: Tool, rig: Rig | None = None) -> Picture:
        """Renders a noise-free image of an object with the rig of this camera or another rig."""
        rig = rig or self.rig
        key = (rig, *tool.appearance)
        if key not in self._renderings:
            for oldest in list(self._renderings)[: 1 - _KEPT]:
                del self._renderings[oldest]
            self._renderings[key] = render(tool, rig)
        return self._renderings[key]

    def take_image(self, tool: Tool, rng: np.random.Generator) -> Picture:
        """Takes an image of an object, with new noise."""
        return self.noise.add_to(self.render(tool), self.rig.camera, rng)

    def take_pictures(self, tool: Tool, rng: np.random.Generator) -> tuple[Photograph, Photograph]:
        """Takes an image of an object from above and, turned over, from below, with new noise."""
        return self._take_pair(present(tool), self.rig, rng)

    def take_sides(self, tool: Tool, rng: np.random.Generator) -> tuple[tuple[Photograph, Photograph], ...]:
        """Takes images of the upright object from both ends of each axis in ``UPRIGHT``.

        The camera is raised by the height of the object. Camera poses are in the rotated frame Q.
        """
        pairs = []
        for R in UPRIGHT:
            presented, turned = present(tool, R)
            low, high = find_box(presented.components)
            rig = replace(self.rig, height=self.rig.height + float(high[2] - low[2]))
            pairs.append(self._take_pair((presented, turned), rig, rng))
        return tuple(pairs)

    def _take_pair(
        self, shown: tuple[Tool, Tool], rig: Rig, rng: np.random.Generator
    ) -> tuple[Photograph, Photograph]:
        """Takes images of an object and of the same object turned over."""
        above, below = (self.noise.add_to(self.render(each, rig), rig.camera, rng) for each in shown)
        return (
            Photograph(above, rig.compute_camera_pose(shown[0]), rig.height),
            Photograph(below, _TURN @ rig.compute_camera_pose(shown[1]), rig.height),
        )

    def detect_parts(self, picture: Picture) -> Detection:
        """Detects the parts of the object in an image. A SeeingError is raised if detection fails."""
        return detect_parts(picture, self.rig, self.noise)

    def observe(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Measures the features of an object in a new image. A SeeingError is raised if detection fails."""
        detection = self.detect_parts(self.take_image(tool, rng))
        return detection.compute_features(self.rig.compute_camera_pose(tool))


def find_presented_pose(tool: Tool) -> Array:
    """Computes the pose X_TP, (4, 4), in which an object is presented: flat, with Pz along its smallest extent."""
    X_TP = np.array(tool.grips[0].X_TG) if tool.grips else np.eye(4)
    low, high = find_box(_move(tool, np.linalg.inv(X_TP)).components)
    extents = high - low
    flat = int(np.argmin(extents))
    if extents[flat] < _FLATTER * extents[2]:
        X_TP[:3, :3] = X_TP[:3, :3] @ UPRIGHT[flat].T
    return X_TP


def present(tool: Tool, R: Array | None = None) -> tuple[Tool, Tool]:
    """Returns the object in frame P, rotated by R, (3, 3), if given, and the same object turned over."""
    X = np.eye(4)
    X[:3, :3] = np.eye(3) if R is None else R
    presented = _move(tool, X @ np.linalg.inv(find_presented_pose(tool)))
    return presented, _move(presented, _TURN)


def _move(tool: Tool, X: Array) -> Tool:
    return replace(tool, components=tuple(replace(part, X_TE=X @ part.X_TE) for part in tool.components))


def needs_turning(tool: Tool) -> bool:
    """Returns True if an object needs two views, because some of its parts are not ellipsoids."""
    return not all(isinstance(part.shape, Ellipsoid) for part in tool.components)


@functools.lru_cache(maxsize=1)
def get_camera_sensor() -> CameraSensor:
    """Returns the camera of this process for objects composed of ellipsoids."""
    return CameraSensor()


@functools.lru_cache(maxsize=1)
def get_turning_stand() -> CameraSensor:
    """Returns the camera of this process for objects that are turned over."""
    return CameraSensor(TURNING_RIG)
