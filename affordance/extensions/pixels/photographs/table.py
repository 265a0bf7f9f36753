"""Finds the plane of the table on which an object stands.

Frames: C the camera's, W the table's, with Wz upwards and Wo on the table below the middle of the object.
"""

from typing import NamedTuple

import cv2
import numpy as np

from affordance.arrays import Array, Mask
from affordance.exceptions import NothingSeenError

# Rounds of RANSAC, and largest distance of a reading from the plane that it belongs to, [m].
_ROUNDS, _NEAR = 400, 8e-3
# Readings within this distance of the object decide which plane is the table, [m]; fewer readings are enough.
_AROUND, _MOST = 0.5, 3000
# A reading this far below a plane speaks against it, [m]: below a table is only what is seen beside it.
_BELOW = 0.03
# Width of the rim around the object to which the plane is refitted, because depth is warped by millimetres, [pixels].
_RIM = 40
_LEAST_READINGS = 200
_LEAST_SHARE = 0.15  # of the readings around the object that are on the table


class Table(NamedTuple):
    """Plane n . p = d in frame C: upward unit normal n, (3,), and d, [m]."""

    normal: Array
    offset: float

    def measure_heights(self, points: Array) -> Array:
        """Computes heights of points in C, (..., 3), above the table, (...), [m]."""
        heights: Array = points @ self.normal - self.offset
        return heights

    def build_frame(self, point: Array) -> Array:
        """Builds the pose X_CW, (4, 4), of the table's frame below a point of C, (3,).

        Wx is as close to Cx as possible.
        """
        x = np.array([1.0, 0.0, 0.0]) - self.normal[0] * self.normal
        x /= np.linalg.norm(x)
        X_CW = np.eye(4)
        X_CW[:3, :3] = np.column_stack([x, np.cross(self.normal, x), self.normal])
        X_CW[:3, 3] = point - self.measure_heights(point) * self.normal
        return X_CW


def find_table(points: Array, place: Array, order: Array, rng: np.random.Generator) -> Table:
    """Finds the table around a place by RANSAC. The table is the plane with most readings on it, and few below it.

    Args:
        points: Positions that pixels show, in C, (height, width, 3), NaN where there is no reading, [m].
        place: Position of the object in C, (3,), [m].
        order: Random number of each pixel, (height, width); readings are taken in this order.
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
            points, f"shows no table: {100 * share_on[best]:.0f} % of the readings around are on one plane"
        )
    on = near[np.abs(heights[best]) < _NEAR]
    return _fit_plane(on)


def refit_table(table: Table, points: Array, mask: Mask) -> Table:
    """Refits the table to its readings next to the object. With few readings it stays unchanged."""
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
