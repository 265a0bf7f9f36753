"""Ray casting of colour and depth images of convex solids on a table, with errors of depth cameras.

A convex solid is the set n(p) <= 1 of a convex function n (gauge). A ray hits the solid if the minimum of n along the
ray is at most one. Boxes, cylinders and superquadrics have such functions. No renderer is required.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.extensions.pixels.photographs.camera import PinholeCamera
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.objects.colour import Colour

_HALVINGS = 40
_CHECK = 0.05  # size of the squares on the table, [m]
_PALE, _DARK = np.array([0.72, 0.66, 0.58]), np.array([0.45, 0.36, 0.30])
_LIGHT = np.array([0.35, -0.25, 0.9])
_SHADOW = 9  # width of the strip without depth readings next to an object, [pixels]


class ScenePart(NamedTuple):
    """Convex solid of one colour."""

    gauge: Callable[[Array], Array]  # computes n at points in W, (..., 3)
    centre: Array  # centre of the bounding sphere in W, (3,), [m]
    radius: float  # radius of the bounding sphere, [m]
    colour: Colour


def box_gauge(half: Sequence[float], X_WS: Array) -> Callable[[Array], Array]:
    """Returns the gauge of a box with half lengths, (3,), [m]."""
    return lambda p: (np.abs((p - X_WS[:3, 3]) @ X_WS[:3, :3]) / np.array(half)).max(axis=-1)


def cylinder_gauge(radius: float, half: float, X_WS: Array) -> Callable[[Array], Array]:
    """Returns the gauge of a cylinder along Sz, given radius and half length, [m]."""

    def gauge(p: Array) -> Array:
        q = (p - X_WS[:3, 3]) @ X_WS[:3, :3]
        return np.maximum(np.hypot(q[..., 0], q[..., 1]) / radius, np.abs(q[..., 2]) / half)

    return gauge


def look_at(distance: float, tilt: float, turn: float = 0.0) -> Array:
    """Builds the pose X_WC, (4, 4), of a camera that points to Wo from above.

    Args:
        distance: Distance from Wo, [m].
        tilt: Angle of the optical axis below the horizontal, [rad].
        turn: Angle about the vertical, [rad].
    """
    forward = np.array([np.sin(turn) * np.cos(tilt), np.cos(turn) * np.cos(tilt), -np.sin(tilt)])
    right = np.array([np.cos(turn), -np.sin(turn), 0.0])
    X_WC = np.eye(4)
    X_WC[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    X_WC[:3, 3] = -distance * forward
    return X_WC


def cast_scene(parts: Sequence[ScenePart], camera: PinholeCamera, X_WC: Array) -> tuple[Picture, Array]:
    """Renders a noise-free image, and the index of the visible part at each pixel, which is -1 for the table."""
    columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.compute_rays(columns, rows) @ X_WC[:3, :3].T  # directions in W with unit depth
    eye = X_WC[:3, 3]
    with np.errstate(divide="ignore"):
        depth = np.where(rays[..., 2] < 0.0, -eye[2] / rays[..., 2], np.inf)
    ground = eye + np.where(np.isfinite(depth), depth, 0.0)[..., None] * rays
    checks = (np.floor(ground[..., :2] / _CHECK).sum(axis=-1) % 2.0).astype(bool)
    colour = np.where(checks[..., None], _PALE, _DARK)
    shown = np.full(depth.shape, -1)
    for number, part in enumerate(parts):
        t, there = _meet(part, eye, rays)
        nearer = there & (t < depth)
        p = eye + t[nearer][:, None] * rays[nearer]
        normal = np.stack([part.gauge(p + d) - part.gauge(p - d) for d in 1e-5 * np.eye(3)], axis=-1)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
        shade = 0.55 + 0.45 * np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
        depth[nearer], shown[nearer], colour[nearer] = t[nearer], number, shade[:, None] * np.array(part.colour)
    depth[~np.isfinite(depth)] = 0.0
    return Picture(np.rint(255.0 * colour).astype(np.uint8), depth), shown


def _meet(part: ScenePart, eye: Array, rays: Array) -> tuple[Array, Mask]:
    """Computes the depth at which rays enter a part, and which rays hit it."""
    middle = ((part.centre - eye) * rays).sum(axis=-1) / (rays * rays).sum(axis=-1)
    gap = np.linalg.norm(eye + middle[..., None] * rays - part.centre, axis=-1)
    candidates = gap < part.radius
    d, t = rays[candidates], middle[candidates]
    reach = part.radius / np.linalg.norm(d, axis=-1)
    low, high = t - reach, t + reach
    for _ in range(_HALVINGS):  # ternary search for the minimum of n, which is convex along a ray
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        falls = part.gauge(eye + one[:, None] * d) > part.gauge(eye + two[:, None] * d)
        low, high = np.where(falls, one, low), np.where(falls, high, two)
    inside, outside = 0.5 * (low + high), t - reach
    there = part.gauge(eye + inside[:, None] * d) <= 1.0
    for _ in range(_HALVINGS):
        half = 0.5 * (inside + outside)
        is_in = part.gauge(eye + half[:, None] * d) <= 1.0
        inside, outside = np.where(is_in, half, inside), np.where(is_in, outside, half)
    depth, mask = np.full(rays.shape[:2], np.inf), np.zeros(rays.shape[:2], dtype=bool)
    depth[candidates], mask[candidates] = inside, there
    return depth, mask


def spoil(
    picture: Picture,
    shown: Array,
    camera: PinholeCamera,
    rng: np.random.Generator,
    *,
    noise: SensorNoise | None = None,
    gloss: float = 0.0,
) -> Picture:
    """Adds sensor noise, shadows, and holes due to gloss to an image.

    Shadows are strips without depth readings to the left of each part.

    Args:
        picture: Noise-free image.
        shown: Index of the visible part at each pixel; -1 for the table.
        camera: Camera.
        rng: Random generator.
        noise: Sensor noise; None for the noise of a common camera.
        gloss: Radius of a hole on each part, relative to the height of the part in the image.
    """
    noisy = (noise or SensorNoise()).add_to(picture, Camera(camera.width, camera.height, camera.fx), rng)
    depth = noisy.depth.copy()
    there = (shown >= 0).astype(np.uint8)
    shadow = np.zeros((1, 2 * _SHADOW + 1), np.uint8)
    shadow[0, _SHADOW:] = 1
    depth[cv2.dilate(there, shadow).astype(bool) & (there == 0)] = np.nan
    for number in range(int(shown.max()) + 1):
        rows, columns = np.nonzero(shown == number)
        if gloss and len(rows):
            chosen = rng.integers(len(rows))
            radius = gloss * np.ptp(rows)
            far = np.hypot(rows - rows[chosen], columns - columns[chosen]) > radius
            depth[rows[~far], columns[~far]] = 0.0
    return Picture(noisy.colour, depth)
