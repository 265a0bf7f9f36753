"""The camera of ``affordance watch`` sees arm, object and panel beside the page's controls."""

import numpy as np
import pytest

from affordance.arrays import Array
from affordance.reporting.live_panel import place_camera, place_panel

# What a browser shows: a window, [px], the width of the open controls at its right, and Meshcat's angle of view.
WIDTH, HEIGHT, CONTROLS = 1000.0, 700.0, 245.0
HALF_ANGLE = np.deg2rad(0.5 * 75.0)


def project(points: Array, camera: Array, target: Array) -> Array:
    """Returns the pixels, from the upper left corner, of points that an upright camera sees, (N, 2)."""
    ahead = (target - camera) / np.linalg.norm(target - camera)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(ahead, right), ahead])
    x, y, depth = axes @ (points - camera).T
    scale = 0.5 * HEIGHT / np.tan(HALF_ANGLE) / depth
    return np.array([0.5 * WIDTH + scale * x, 0.5 * HEIGHT + scale * y]).T


@pytest.mark.parametrize(
    "p_WF",
    [
        [[0.0, 0.0, 1.44], [0.33, 0.0, 1.44], [0.77, 0.0, 1.44]],
        [[0.0, 0.0, 1.0], [1.0, 0.0, 1.1], [2.8, 0.0, 1.0]],
        [[0.0, 0.0, 0.0], [0.1, 0.0, 0.5], [0.5, 0.0, 0.7], [0.9, 0.0, 0.4]],
        [[1.0, 1.0, 0.0], [1.3, 1.3, 0.3], [1.5, 1.5, 0.2]],
    ],
    ids=["straight", "long", "bent", "diagonal"],
)
def test_arm_object_and_panel_are_seen_beside_the_controls(p_WF: list[list[float]]) -> None:
    """The arm is a fifth of its reach thick; its object reaches two fifths of it further, and hangs as far down."""
    frames = np.array(p_WF)
    panel = place_panel(frames)
    along, reach = frames[-1] - frames[0], float(np.linalg.norm(frames[-1] - frames[0]))
    forwards = along * [1.0, 1.0, 0.0] / np.linalg.norm(along[:2])
    nearer = 0.1 * reach * np.cross(forwards, [0.0, 0.0, 1.0])
    below = frames[-1] - [0.0, 0.0, 0.4 * reach]
    solid = (
        np.array([*frames, frames[0] - 0.1 * reach * forwards, frames[0] + 1.4 * reach * forwards, below]) + nearer
    )
    corners = panel.corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ np.array([panel.right, panel.up])
    seen = project(np.array([*solid, *corners]), *place_camera(frames, panel))
    assert (seen >= 0.0).all()
    assert (seen <= [WIDTH - CONTROLS, HEIGHT]).all()
    assert np.ptp(seen[:, 0]) > 0.5 * (WIDTH - CONTROLS)  # nor is all of it small
