"""Camera over a stand: pictures of an object as it lies there, or from two sides, for which it is turned over.

Frame P is the object's as it is presented from two sides: that of its first grip, whose Gz points out of the plane in
which a tool lies flat, or T without a grip. In the second view it is turned over about Px. Its lowest point always
lies on the stand, and its pose is known from the hand that puts it there.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.pipeline import Detection, detect_parts
from affordance.vision.pixels.rgbd import Camera, Labels, Picture
from affordance.vision.pixels.rig import DEFAULT_RIG, Rig, render, render_labels
from affordance.vision.pixels.sensor_noise import SensorNoise

# Twice the pixels of the first Kinect and two thirds of its distance: half a millimetre per pixel. The noise is in
# pixels, so that this camera's depth is sharper by the same factor.
TURNING_RIG = Rig(camera=Camera(width=1280, height=960, focal_length=1178.8), height=0.6)
# Half a turn about Px.
_TURN = np.diag([1.0, -1.0, -1.0, 1.0])


class Photograph(NamedTuple):
    """Picture of a presented object, and the pose of the camera.

    Attributes:
        picture: Colour and depth picture.
        X_PC: Pose of the camera in the presented object, shape (4, 4).
    """

    picture: Picture
    X_PC: Array


class CameraSensor:
    """Camera for objects on a stand; the noise-free picture of each appearance is rendered once."""

    def __init__(self, rig: Rig = DEFAULT_RIG, noise: SensorNoise = SensorNoise()) -> None:
        """Stores the stand with its camera, and the noise of a picture."""
        self.rig = rig
        self.noise = noise
        self._renderings: dict[tuple[object, ...], Picture] = {}

    def render(self, tool: Tool) -> Picture:
        """Renders the picture of an object without noise."""
        if tool.appearance not in self._renderings:
            self._renderings[tool.appearance] = render(tool, self.rig)
        return self._renderings[tool.appearance]

    def render_labels(self, tool: Tool) -> tuple[Labels, Labels]:
        """Renders the index of the part that each pixel of two sides shows, -1 for none; not for inference."""
        presented, turned = present(tool)
        return render_labels(presented, self.rig), render_labels(turned, self.rig)

    def take_image(self, tool: Tool, rng: np.random.Generator) -> Picture:
        """Takes a picture of an object, with new noise."""
        return self.noise.add_to(self.render(tool), self.rig.camera, rng)

    def take_pictures(self, tool: Tool, rng: np.random.Generator) -> tuple[Photograph, Photograph]:
        """Takes a picture of an object from either side, with new noise."""
        presented, turned = present(tool)
        above, below = self.take_image(presented, rng), self.take_image(turned, rng)
        return (
            Photograph(above, self.rig.compute_camera_pose(presented)),
            Photograph(below, _TURN @ self.rig.compute_camera_pose(turned)),
        )

    def detect_parts(self, picture: Picture) -> Detection:
        """Detects the parts that a picture shows; raises a SeeingError if there are none."""
        return detect_parts(picture, self.rig, self.noise)

    def observe(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Takes a picture of an object and returns its features; raises a SeeingError if no part is detected."""
        detection = self.detect_parts(self.take_image(tool, rng))
        return detection.compute_features(self.rig.compute_camera_pose(tool))


def find_presented_pose(tool: Tool) -> Array:
    """Returns the pose X_TP in which an object is presented, shape (4, 4)."""
    return tool.grips[0].X_TG if tool.grips else np.eye(4)


def present(tool: Tool) -> tuple[Tool, Tool]:
    """Returns the object in the frame P, and turned over."""
    presented = tool.gripped_by(tool.grips[0]) if tool.grips else tool
    turned = tuple(replace(part, X_TE=_TURN @ part.X_TE) for part in presented.components)
    return presented, replace(presented, components=turned)


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
