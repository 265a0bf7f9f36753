"""Camera over a stand: pictures of an object as it lies there, or from two sides, for which it is turned over.

Frame P is the object's as it is presented: that of its first grip, or T without a grip, with axes renamed so that Pz
is out of the plane in which the object lies flat. In the second view it is turned over about Px. Its lowest point
always lies on the stand, and its pose is known from the hand that puts it there.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool, find_box
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.pipeline import Detection, detect_parts
from affordance.vision.pixels.rgbd import Camera, Picture
from affordance.vision.pixels.rig import DEFAULT_RIG, Rig, render
from affordance.vision.pixels.sensor_noise import SensorNoise

# Twice the pixels of the first Kinect and two thirds of its distance: half a millimetre per pixel. The noise is in
# pixels, so that this camera's depth is sharper by the same factor.
TURNING_RIG = Rig(camera=Camera(width=1280, height=960, focal_length=1178.8), height=0.6)
# Half a turn about Px.
_TURN = np.diag([1.0, -1.0, -1.0, 1.0])
# Share of its extent along another axis below which an object lies along that axis rather than along Gz.
_FLATTER = 0.9
# Rotations after which Px points up, and Py.
UPRIGHT = (np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))


class Photograph(NamedTuple):
    """Picture of a presented object, with the camera's pose X_PC, (4, 4), and the depth of the stand's top, [m]."""

    picture: Picture
    X_PC: Array
    stand_depth: float


class CameraSensor:
    """Camera for objects on a stand; the noise-free picture of each appearance is rendered once."""

    def __init__(self, rig: Rig = DEFAULT_RIG) -> None:
        """Stores the stand with its camera, whose pictures have the noise of a common one until ``noise`` is set."""
        self.rig = rig
        self.noise = SensorNoise()
        self._renderings: dict[tuple[object, ...], Picture] = {}

    def render(self, tool: Tool, rig: Rig | None = None) -> Picture:
        """Renders the picture of an object without noise, on this stand or that of a rig."""
        rig = rig or self.rig
        key = (rig, *tool.appearance)
        if key not in self._renderings:
            self._renderings[key] = render(tool, rig)
        return self._renderings[key]

    def take_image(self, tool: Tool, rng: np.random.Generator) -> Picture:
        """Takes a picture of an object, with new noise."""
        return self.noise.add_to(self.render(tool), self.rig.camera, rng)

    def take_pictures(self, tool: Tool, rng: np.random.Generator) -> tuple[Photograph, Photograph]:
        """Takes a picture of an object from either side, with new noise."""
        return self._take_pair(present(tool), self.rig, rng)

    def take_sides(self, tool: Tool, rng: np.random.Generator) -> tuple[tuple[Photograph, Photograph], ...]:
        """Takes pictures of an object that stands upright along each axis of ``UPRIGHT``, from either end.

        The camera is raised by the object's height. Its poses are those in the rotated frame.
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
        """Takes pictures of an object and of the same turned over."""
        above, below = (self.noise.add_to(self.render(each, rig), rig.camera, rng) for each in shown)
        return (
            Photograph(above, rig.compute_camera_pose(shown[0]), rig.height),
            Photograph(below, _TURN @ rig.compute_camera_pose(shown[1]), rig.height),
        )

    def detect_parts(self, picture: Picture) -> Detection:
        """Detects the parts that a picture shows; raises a SeeingError if there are none."""
        return detect_parts(picture, self.rig, self.noise)

    def observe(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Takes a picture of an object and returns its features; raises a SeeingError if no part is detected."""
        detection = self.detect_parts(self.take_image(tool, rng))
        return detection.compute_features(self.rig.compute_camera_pose(tool))


def find_presented_pose(tool: Tool) -> Array:
    """Returns the pose X_TP in which an object is presented, (4, 4): flat, Pz along its least extent."""
    X_TP = np.array(tool.grips[0].X_TG) if tool.grips else np.eye(4)
    low, high = find_box(_move(tool, np.linalg.inv(X_TP)).components)
    extents = high - low
    flat = int(np.argmin(extents))
    if extents[flat] < _FLATTER * extents[2]:
        X_TP[:3, :3] = X_TP[:3, :3] @ UPRIGHT[flat].T
    return X_TP


def present(tool: Tool, R: Array | None = None) -> tuple[Tool, Tool]:
    """Returns the object in the frame P, or rotated by R, (3, 3), and turned over."""
    X = np.eye(4)
    X[:3, :3] = np.eye(3) if R is None else R
    presented = _move(tool, X @ np.linalg.inv(find_presented_pose(tool)))
    return presented, _move(presented, _TURN)


def _move(tool: Tool, X: Array) -> Tool:
    return replace(tool, components=tuple(replace(part, X_TE=X @ part.X_TE) for part in tool.components))


def needs_turning(tool: Tool) -> bool:
    """Returns whether an object has parts other than ellipsoids, whose far side one view does not determine."""
    return not all(isinstance(part.shape, Ellipsoid) for part in tool.components)


@functools.lru_cache(maxsize=1)
def get_camera_sensor() -> CameraSensor:
    """Returns this process's camera for objects made of ellipsoids."""
    return CameraSensor()


@functools.lru_cache(maxsize=1)
def get_turning_stand() -> CameraSensor:
    """Returns this process's camera for objects that are turned over."""
    return CameraSensor(TURNING_RIG)
