"""Places a camera at the side of an arm so that it sees the whole motion."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.geometry import QueryObject, Role
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import Context

from affordance.arrays import Array

# Factor for the margin of a picture, and height of the camera above the scene as a fraction of its distance.
_MARGIN, _ABOVE = 1.12, 0.15
_UP = np.array([0.0, 0.0, 1.0])
# Corners of a box, in half widths.
_CORNERS = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)


class SideView(NamedTuple):
    """View of a camera."""

    place: Array  # position of the camera, (3,), [m]
    target: Array  # point at which the camera looks, (3,), [m]
    wide: float  # tangent of half the horizontal view angle
    high: float  # tangent of half the vertical view angle


def list_corners(query: QueryObject) -> Array:
    """Lists the corners of bounding boxes of all drawn shapes, (N, 3), [m]."""
    inspector = query.inspector()
    corners = []
    for frame in inspector.GetAllFrameIds():
        for geometry in inspector.GetGeometries(frame, Role.kIllustration):
            if (box := inspector.GetObbInGeometryFrame(geometry)) is not None:
                X_WB = query.GetPoseInWorld(geometry) @ box.pose()
                corners.append((X_WB @ (_CORNERS * box.half_width()).T).T)
    return np.concatenate(corners) if corners else np.zeros((0, 3))


def find_direction(plant: MultibodyPlant, context: Context, hand: Frame) -> Array:
    """Computes the horizontal direction from an arm's base to its hand, (3,).

    If the hand is above the base, the direction is along x.
    """
    first_joint = plant.get_joint_actuator(plant.GetJointActuatorIndices()[0]).joint()
    places = [frame.CalcPoseInWorld(context).translation() for frame in (first_joint.frame_on_parent(), hand)]
    out = (places[1] - places[0]) * [1.0, 1.0, 0.0]
    length = float(np.linalg.norm(out))
    return out / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])


def place_camera(points: Array, out: Array, middle: Sequence[float] | Array | None = None) -> SideView:
    """Places a camera so that it sees all given points.

    Args:
        points: Points to be seen, (N, 3), [m].
        out: Horizontal unit vector that points to the right in the picture, (3,).
        middle: Point in the middle of the picture, (3,), [m]; None for the middle of the points.
    """
    axes = np.array([out, _UP, np.cross(out, _UP)])  # to the right, up and towards the camera
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    target = np.array(middle) if middle is not None else 0.5 * (low + high) @ axes
    right, up, front = np.maximum(high - axes @ target, axes @ target - low)
    far = 2.0 * max(right, up) + front
    place = target + far * (axes[2] + _ABOVE * _UP)
    ahead = (target - place) / np.linalg.norm(target - place)
    depths = (points - place) @ ahead
    tangents = [
        _MARGIN * float(np.abs((points - place) @ axis / depths).max()) for axis in (out, np.cross(out, ahead))
    ]
    return SideView(place, target, *tangents)
