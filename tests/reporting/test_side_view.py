"""The camera at an arm's side sees all points that it is given, as large as the window allows."""

import numpy as np
import pytest

from affordance.arrays import Array
from affordance.reporting.side_view import SideView, place_camera


def project(points: Array, view: SideView) -> Array:
    """Returns tangents of the angles, to the right and upwards, at which an upright camera sees points, (N, 2)."""
    ahead = (view.target - view.place) / np.linalg.norm(view.target - view.place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    x, y, depth = np.array([right, np.cross(right, ahead), ahead]) @ (points - view.place).T
    assert (depth > 0.0).all()
    return np.array([x, y]).T / depth[:, None]


@pytest.mark.parametrize(
    ("points", "out"),
    [
        ([[0.0, 0.0, 1.4], [0.8, 0.1, 1.5], [0.3, -0.1, 1.3]], [1.0, 0.0, 0.0]),
        ([[0.0, 0.0, 0.0], [0.1, 0.1, 2.8]], [1.0, 0.0, 0.0]),
        ([[1.0, 1.0, 0.0], [1.5, 1.5, 0.2], [1.3, 1.2, 0.6]], [0.5**0.5, 0.5**0.5, 0.0]),
        ([[0.0, 0.0, 0.5], [0.0, -0.7, 0.5]], [0.0, -1.0, 0.0]),
    ],
    ids=["long", "upright", "diagonal", "backwards"],
)
def test_all_is_seen_and_nothing_is_small(points: list[list[float]], out: list[float]) -> None:
    """What lies outwards is to the right; the outermost point is within a quarter of the edge."""
    view = place_camera(np.array(points), np.array(out))
    seen = project(np.array(points), view) / [view.wide, view.high]
    assert (np.abs(seen) < 1.0).all()
    assert np.abs(seen).max(axis=0) == pytest.approx(0.9, abs=0.15)
    along = np.array(points) @ out
    assert seen[along.argmax(), 0] > seen[along.argmin(), 0] or np.ptp(along) < 1e-9


def test_a_given_middle_is_in_the_middle() -> None:
    """A nail at one side is in the middle of the picture, and the arm is still seen."""
    points, nail = np.array([[0.0, 0.0, 1.0], [0.9, 0.0, 1.2]]), np.array([0.8, 0.0, 1.0])
    view = place_camera(points, np.array([1.0, 0.0, 0.0]), nail)
    np.testing.assert_allclose(project(nail[None], view), 0.0, atol=1e-12)
    assert (np.abs(project(points, view)) < [view.wide, view.high]).all()
