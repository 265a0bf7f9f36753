"""Pictures computed from ellipsoids without a renderer: exact depth, colours in the light of the stand."""

import numpy as np

from affordance.extensions.pixels.ellipsoid_fit import SeenEllipsoid, trace_rays
from affordance.extensions.pixels.rgbd import Camera, Picture
from affordance.extensions.pixels.rig import DEFAULT_RIG, compute_shading
from affordance.extensions.pixels.sensor_noise import SensorNoise

CAMERA = DEFAULT_RIG.camera
STAND = DEFAULT_RIG.height
PERFECT = SensorNoise(depth_scale=0.0, signal_to_noise=np.inf)
NOISY = SensorNoise()
EMPTY = Picture(np.full((480, 640, 3), 51, dtype=np.uint8), np.full((480, 640), STAND))


def make_ellipsoid(semi_axes, centre, R_CE=None):
    R_CE = np.eye(3) if R_CE is None else R_CE
    return SeenEllipsoid(np.array(centre, dtype=float), (R_CE * np.array(semi_axes) ** 2) @ R_CE.T)


def draw_picture(ellipsoids, colours, camera: Camera = CAMERA) -> Picture:
    """Draws ellipsoids in C, the nearest in front, before the stand."""
    rows, columns = np.indices((camera.height, camera.width))
    rays = camera.compute_rays(np.column_stack([columns.ravel(), rows.ravel()]).astype(float))
    depth, colour = np.full(len(rays), STAND), np.full((len(rays), 3), 51, dtype=np.uint8)
    for ellipsoid, own in zip(ellipsoids, colours, strict=True):
        seen = trace_rays(ellipsoid, rays, camera.focal_length)
        front = (seen.outline_distance > 0.0) & (seen.depth < depth)
        normals = seen.normals / np.linalg.norm(seen.normals, axis=1, keepdims=True)
        depth[front] = seen.depth[front]
        colour[front] = np.rint(255.0 * compute_shading(normals[front])[:, None] * np.array(own)).astype(np.uint8)
    return Picture(colour.reshape(camera.height, camera.width, 3), depth.reshape(camera.height, camera.width))
