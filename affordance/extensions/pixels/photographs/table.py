"""Plane of the table below an object.

C is the camera frame. W is the table frame, with Wz upwards and Wo on the table below the middle of the object.
"""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import NothingSeenError

# Number of RANSAC iterations, and largest distance of an inlier from the plane, [m].
_ROUNDS, _NEAR = 400, 8e-3
# Largest distance from the object, [m], and largest number of readings for RANSAC.
_AROUND, _MOST = 0.5, 3000
# Readings at least this far below a plane are evidence against a table, [m].
_BELOW = 0.03
# Width of the rim around the object for refitting the plane, because depth images are warped by millimetres,
# [pixels].
_RIM = 40
_LEAST_READINGS = 200
_LEAST_SHARE = 0.15  # smallest fraction of readings around the object that are on the table


class Table(NamedTuple):
    """Plane n . p = d in frame C."""

    normal: Array  # upward unit normal n, (3,)
    offset: float  # d, [m]

    def measure_heights(self, points: Array) -> Array:
        """Computes the height of points in C, (..., 3), above the table, (...), [m]."""
        heights: Array = points @ self.normal - self.offset
        return heights

    def build_frame(self, point: Array) -> Array:
        """Builds the pose X_CW, (4, 4), of the table frame below a point in C, (3,), with Wx near Cx."""
        x = np.array([1.0, 0.0, 0.0]) - self.normal[0] * self.normal
        x /= np.linalg.norm(x)
        X_CW = np.eye(4)
        X_CW[:3, :3] = np.column_stack([x, np.cross(self.normal, x), self.normal])
        X_CW[:3, 3] = point - self.measure_heights(point) * self.normal
        return X_CW


def find_table(points: Array, place: Array, order: Array, rng: np.random.Generator) -> Table:
    """Finds the table around an object with RANSAC: the plane with most readings on it and few below it.

    Args:
        points: Positions of pixels in C, (height, width, 3), [m]; NaN without a depth reading.
        place: Position of the object in C, (3,), [m].
        order: Random number of each pixel, (height, width), which determines the sampled readings.
        rng: Random number generator.

    Raises:
        NothingSeenError: There is no plane around the object.
    """
    is_near = np.linalg.norm(points - place, axis=-1) < _AROUND
    near = points[is_near][np.argsort(order[is_near])]
    if len(near) < _LEAST_READINGS:
        raise _complain(points, f"has {len(near)} depth readings within {_AROUND:g} m of the object")
    near = near[:_MOST]
    corners = near[rng.integers(len(near), size=(_ROUNDS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 0.0] / lengths[lengths > 0.0, None]
    corners = corners[lengths > 0.0, 0]
    offsets = (normals * corners).sum(axis=1)
    turn = np.where(offsets < 0.0, 1.0, -1.0)  # the camera, at the origin, is above the table
    normals, offsets = turn[:, None] * normals, turn * offsets
    heights = normals @ near.T - offsets[:, None]  # (rounds, readings)
    share_on, share_below = (np.abs(heights) < _NEAR).mean(axis=1), (heights < -_BELOW).mean(axis=1)
    best = int(np.argmax(share_on - share_below))
    if share_on[best] < _LEAST_SHARE:
        raise _complain(
            points, f"shows no table: {100 * share_on[best]:.0f} % of the readings around the object are on one plane"
        )
    on = near[np.abs(heights[best]) < _NEAR]
    return _fit_plane(on)


def refit_table(table: Table, points: Array, mask: Mask) -> Table:
    """Refits the table to readings next to the object, if there are enough."""
    side = 2 * _RIM + 1
    rim = cv2.dilate(mask.astype(np.uint8), np.ones((side, side), np.uint8)).astype(bool) & ~mask
    on = points[rim & (np.abs(table.measure_heights(points)) < _NEAR)]
    return _fit_plane(on) if len(on) >= _LEAST_READINGS else table


def _fit_plane(points: Array) -> Table:
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    normal *= -np.sign(normal @ middle)
    return Table(normal, float(normal @ middle))


def _complain(points: Array, reason: str) -> NothingSeenError:
    return NothingSeenError(f"the depth picture {reason}", np.zeros((*points.shape[:2], 3)), points[..., 2])
