"""Stand on which an object of any form is observed from two sides: as it lies there, and turned over.

Frame P is the object's as it is presented: that of its first grip, whose Gz points out of the plane in which a tool
lies flat, or T without a grip. In the second view it is turned over about Px. Its lowest point always lies on the
stand, and its pose is known from the hand that puts it there.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import Ellipsoid
from affordance.objects.tool import Tool
from affordance.vision.pixels.rgbd import Camera, Labels, Picture
from affordance.vision.pixels.rig import Rig, render, render_labels
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


class TurningStand:
    """Stand for pictures of an object from above and, turned over, from below; noise-free ones are rendered once."""

    def __init__(self, rig: Rig = TURNING_RIG, noise: SensorNoise = SensorNoise()) -> None:
        """Stores the stand with its camera, and the noise of a picture."""
        self.rig = rig
        self.noise = noise
        self._pictures: dict[tuple[object, ...], tuple[Picture, Picture]] = {}

    def take_pictures(self, tool: Tool, rng: np.random.Generator) -> tuple[Photograph, Photograph]:
        """Takes a picture from either side, with new noise."""
        above, below = (self.noise.add_to(picture, self.rig.camera, rng) for picture in self.render(tool))
        presented, turned = present(tool)
        return (
            Photograph(above, self.rig.compute_camera_pose(presented)),
            Photograph(below, _TURN @ self.rig.compute_camera_pose(turned)),
        )

    def render(self, tool: Tool) -> tuple[Picture, Picture]:
        """Renders the two pictures without noise."""
        presented, turned = present(tool)
        if presented.appearance not in self._pictures:
            self._pictures[presented.appearance] = (render(presented, self.rig), render(turned, self.rig))
        return self._pictures[presented.appearance]

    def render_labels(self, tool: Tool) -> tuple[Labels, Labels]:
        """Renders the index of the part that each pixel shows, -1 for none; for statistics, not for inference."""
        presented, turned = present(tool)
        return render_labels(presented, self.rig), render_labels(turned, self.rig)


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
def get_turning_stand() -> TurningStand:
    """Returns this process's turning stand."""
    return TurningStand()
