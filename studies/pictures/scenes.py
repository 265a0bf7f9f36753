"""Ray-cast scenes of one object at random positions, with errors of a depth camera."""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.photographs.ray_scene import (
    ScenePart,
    box_gauge,
    cast_scene,
    cylinder_gauge,
    look_at,
    spoil,
)
from affordance.extensions.pixels.photographs.superquadric import Superquadric
from affordance.extensions.pixels.rgbd import Picture
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.objects.tool_entries import build_pose

_FOCAL = 525.0


class Scene(NamedTuple):
    """Image of one object, with ground truth."""

    picture: Picture
    camera: PinholeCamera
    kind: str
    volume: float  # true volume, [m^3]
    centre: Array  # true centre in C, (3,), [m]
    at: tuple[float, float]  # pixel of the object, column and row


def draw_scene(seed: int, number: int) -> Scene:
    """Generates a scene with a vertical or horizontal box, cylinder or superquadric, and with sensor errors."""
    rng = np.random.default_rng([seed, number])
    kind = ("box", "cylinder", "superquadric")[number % 3]
    half = np.exp(rng.uniform(np.log(0.015), np.log(0.09), 3))
    yaw = float(rng.uniform(0.0, 180.0))
    if kind == "cylinder":
        radius, is_lying = float(half[0]), rng.random() < 0.5
        X = build_pose([0.0, 0.0, radius if is_lying else half[1]], (0.0, 90.0, yaw) if is_lying else (0.0, 0.0, yaw))
        gauge, volume = cylinder_gauge(radius, float(half[1]), X), 2.0 * np.pi * radius**2 * half[1]
        reach = float(np.hypot(radius, half[1]))
    else:
        X = build_pose([0.0, 0.0, half[2]], (0.0, 0.0, yaw))
        gauge, volume, reach = box_gauge(half.tolist(), X), 8.0 * np.prod(half), float(np.linalg.norm(half))
        if kind == "superquadric":
            solid = Superquadric(half, rng.uniform(0.1, 1.0, 2), X)
            gauge, volume = solid.compute_gauge, solid.volume
    r, g, b = rng.uniform(0.1, 0.9, 3)
    part = ScenePart(gauge, X[:3, 3], 1.1 * reach, (float(r), float(g), float(b)))
    camera = PinholeCamera(640, 480, _FOCAL, _FOCAL, *rng.uniform([310.0, 230.0], [330.0, 250.0]))
    X_WC = look_at(float(rng.uniform(0.6, 1.1)), float(rng.uniform(0.45, 1.1)), float(rng.uniform(0.0, 6.28)))
    X_WC = X_WC @ build_pose([0.0, 0.0, 0.0], (0.0, 0.0, float(rng.uniform(-10.0, 10.0))))
    clean, shown = cast_scene([part], camera, X_WC)
    gloss = float(rng.choice([0.0, 0.1, 0.2]))
    noise = SensorNoise(depth_scale=float(rng.choice([0.5, 1.0, 1.5])))
    picture = spoil(clean, shown, camera, rng, noise=noise, gloss=gloss)
    rows, columns = np.nonzero(shown == 0)
    middle = int(np.argmin(np.hypot(rows - np.median(rows), columns - np.median(columns))))
    centre = X_WC[:3, :3].T @ (X[:3, 3] - X_WC[:3, 3])
    return Scene(picture, camera, kind, float(volume), centre, (float(columns[middle]), float(rows[middle])))
