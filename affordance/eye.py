"""The eye: what is measured of an object presented, by the sight the settings name.

Either true features with a stated error (vision.py), or features from a picture of the object on its stand
(seeing/), and from nothing else. Both come out of the same port.
"""

import functools

import numpy as np

from affordance.exceptions import SeeingError
from affordance.seeing.picture import Picture
from affordance.seeing.rig import DEFAULT_RIG, Rendering, Rig, render
from affordance.seeing.see import Seen, see
from affordance.seeing.sensor_noise import SensorNoise
from affordance.settings import Settings, Sight
from affordance.tools import Tool
from affordance.vision import observe
from affordance.visual_prior import ComponentFeatures


class Eye:
    """Looks at objects on a stand; what an appearance looks like without noise is rendered once."""

    def __init__(self, rig: Rig = DEFAULT_RIG, noise: SensorNoise = SensorNoise()) -> None:
        """Takes the stand with its camera, and the noise of a look."""
        self.rig = rig
        self.noise = noise
        self._renderings: dict[tuple[object, ...], Rendering] = {}

    def take_picture(self, tool: Tool, rng: np.random.Generator) -> Picture:
        """Takes a picture of an object, with new noise."""
        if tool.appearance not in self._renderings:
            self._renderings[tool.appearance] = render(tool, self.rig)
        return self.noise.add_to(self._renderings[tool.appearance].picture, self.rig.camera, rng)

    def see(self, picture: Picture) -> Seen:
        """Makes out what a picture shows; raises a SeeingError if it cannot."""
        return see(picture, self.rig, self.noise)

    def look(self, tool: Tool, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
        """Takes a picture of an object and returns the features it shows; raises a SeeingError if it shows none."""
        seen = self.see(self.take_picture(tool, rng))
        return seen.compute_features(self.rig.compute_camera_pose(tool))


@functools.lru_cache(maxsize=1)
def get_eye() -> Eye:
    """Returns this process's eye."""
    return Eye()


def look(tool: Tool, settings: Settings, rng: np.random.Generator) -> tuple[ComponentFeatures, ...]:
    """Measures an object as the settings say.

    Args:
        tool: The object.
        settings: Whether features are measured or seen in pictures, and with which error they are measured.
        rng: Draws the errors of the measurement, or the noise of the picture.

    Raises:
        SeeingError: The picture does not show what is needed.
    """
    if settings.sight is Sight.FEATURES:
        return observe(tool, settings.vision_error, rng)
    try:
        return get_eye().look(tool, rng)
    except SeeingError as error:
        raise type(error)(f"{tool.name}: {error.reason}", error.colour, error.depth) from error
