"""Camera over a stand, as a source of features."""

import functools

import numpy as np

from affordance.objects.tool import Tool
from affordance.vision.features import ComponentFeatures
from affordance.vision.pixels.pipeline import Detection, detect_parts
from affordance.vision.pixels.rgbd import Picture
from affordance.vision.pixels.rig import DEFAULT_RIG, Rig, render
from affordance.vision.pixels.sensor_noise import SensorNoise


class CameraSensor:
    """Camera for objects on a stand; the noise-free picture of each appearance is rendered once."""

    def __init__(self, rig: Rig = DEFAULT_RIG, noise: SensorNoise = SensorNoise()) -> None:
        """Stores the stand with its camera, and the noise of a picture."""
        self.rig = rig
        self.noise = noise
        self._renderings: dict[tuple[object, ...], Picture] = {}

    def take_image(self, tool: Tool, rng: np.random.Generator) -> Picture:
        """Takes a picture of an object, with new noise."""
        if tool.appearance not in self._renderings:
            self._renderings[tool.appearance] = render(tool, self.rig)
        return self.noise.add_to(self._renderings[tool.appearance], self.rig.camera, rng)

    def detect_parts(self, picture: Picture) -> Detection:
        """Detects the parts that a picture shows; raises a SeeingError if there are none."""
        return detect_parts(picture, self.rig, self.noise)

    def observe(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Takes a picture of an object and returns its features; raises a SeeingError if no part is detected."""
        detection = self.detect_parts(self.take_image(tool, rng))
        return detection.compute_features(self.rig.compute_camera_pose(tool))


@functools.lru_cache(maxsize=1)
def get_camera_sensor() -> CameraSensor:
    """Returns this process's camera sensor."""
    return CameraSensor()
