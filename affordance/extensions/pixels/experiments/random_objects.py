"""Random chains of touching ellipsoids and their images, for testing detection."""

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.extensions.pixels.camera_sensor import get_camera_sensor
from affordance.extensions.pixels.rgbd import Picture
from affordance.extensions.pixels.rig import render
from affordance.objects.inertia import Ellipsoid
from affordance.objects.materials import Material
from affordance.objects.tool import Component, Tool, find_box

# Range of the axis lengths of parts, [m], and largest number of parts.
_LENGTHS = (0.03, 0.30)
MAX_PARTS = 3
# Largest bounding box of an object that fits the image, (length, breadth, height), [m].
_MAX_BOX = (0.55, 0.40, 0.30)
# Largest inclination of the direction from part to part, and largest angle between successive directions, [rad]. They
# are limited so that no part occludes another.
_MAX_INCLINATION, _MAX_TURN = np.radians(20.0), np.radians(60.0)
# Densities from the lightest wood to lead, [kg/m^3].
_DENSITIES = (200.0, 11_000.0)
_OBJECT, _NOISE = 0, 1  # last entry of a random seed, after the root seed and the number of the object


def draw_numbered_object(seed: int, number: int) -> Tool:
    """Generates the random object with a given number."""
    return draw_object(np.random.default_rng([seed, number, _OBJECT]), f"object {number}")


def take_picture(seed: int, number: int) -> Picture:
    """Takes a noisy image of the random object with a given number."""
    sensor = get_camera_sensor()
    picture = render(draw_numbered_object(seed, number), sensor.rig)
    return sensor.noise.add_to(picture, sensor.rig.camera, np.random.default_rng([seed, number, _NOISE]))


def draw_object(rng: np.random.Generator, name: str) -> Tool:
    """Generates an object of one to three ellipsoids with random sizes, directions, colours and densities."""
    while True:
        tool = Tool(name, tuple(_draw_chain(rng)))
        low, high = find_box(tool.components)
        if (high - low <= _MAX_BOX).all():
            return tool


def _draw_chain(rng: np.random.Generator) -> list[Component]:
    parts: list[Component] = []
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    before: Component | None = None
    for number in range(rng.integers(1, MAX_PARTS + 1)):
        azimuth += rng.uniform(-_MAX_TURN, _MAX_TURN)
        inclination = rng.uniform(-_MAX_INCLINATION, _MAX_INCLINATION)
        along = np.array(
            [np.cos(azimuth) * np.cos(inclination), np.sin(azimuth) * np.cos(inclination), np.sin(inclination)]
        )
        shape, R_TE = _draw_ellipsoid(rng), Rotation.random(rng=rng).as_matrix()
        X_TE = np.eye(4)
        X_TE[:3, :3] = R_TE
        if before is not None:
            # The parts touch at one point: the farthest point of the previous part along the direction, and of this
            # part in the opposite direction.
            R_TB, p_TB = before.X_TE[:3, :3], before.X_TE[:3, 3]
            X_TE[:3, 3] = p_TB + R_TB @ before.shape.find_support(R_TB.T @ along)
            X_TE[:3, 3] += R_TE @ shape.find_support(R_TE.T @ along)
        material = _draw_material(rng, f"material_{number}")
        before = Component(shape, X_TE, material, material)
        parts.append(before)
    return parts


def _draw_ellipsoid(rng: np.random.Generator) -> Ellipsoid:
    a, b, c = (float(0.5 * length) for length in _LENGTHS[0] * (_LENGTHS[1] / _LENGTHS[0]) ** rng.random(3))
    return Ellipsoid((a, b, c))


def _draw_material(rng: np.random.Generator, name: str) -> Material:
    red, green, blue = (float(value) for value in rng.random(3))
    density = float(_DENSITIES[0] * (_DENSITIES[1] / _DENSITIES[0]) ** rng.random())
    return Material(name, (red, green, blue), density, 0.0, "drawn at random")
