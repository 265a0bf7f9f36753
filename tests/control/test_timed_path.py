import numpy as np
import pytest
from helpers.refusals import refuse
from scipy.optimize import brentq

from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS

POINTS = ((0.1, 0.0, 0.2), (0.3, -0.1, 0.2))


@pytest.mark.parametrize(
    ("time", "name"),
    [
        (0.0, "the start"),
        (0.5, "the start"),
        (1.0, "point 1 of 2 at [0.1, 0, 0.2]"),
        (2.0, "point 2 of 2 at [0.3, -0.1, 0.2]"),
        (2.5, "point 2 of 2 at [0.3, -0.1, 0.2]"),
    ],
)
def test_nearest_point_is_named_by_number_and_place(time, name):
    assert TimedPath(POINTS, duration=2.0, tolerance=0.01).name_nearest_point(time) == name


def test_path_runs_through_its_points_from_rest_to_rest():
    path = TimedPath(POINTS, duration=2.0, tolerance=0.01).build_trajectory()
    assert (path.start_time(), path.end_time()) == (0.0, 2.0)
    times = np.linspace(0.0, 2.0, 20_001)
    places = np.array([path.value(time)[:, 0] for time in times])
    np.testing.assert_allclose(places[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(places[-1], POINTS[-1], atol=1e-12)
    assert np.linalg.norm(places - POINTS[0], axis=1).min() < 1e-4
    for time in (0.0, 2.0):
        np.testing.assert_allclose(path.EvalDerivative(time, 1), 0.0, atol=1e-12)
        np.testing.assert_allclose(path.EvalDerivative(time, 2), 0.0, atol=1e-9)


def test_timing_along_a_line_is_that_of_minimum_jerk():
    """Speed along a line is that of minimum jerk from rest to rest, 30 u^2 (1 - u)^2 distances per duration."""
    path = TimedPath(((0.0, 0.6, 0.0),), duration=1.5, tolerance=0.01).build_trajectory()
    for u in (0.1, 0.25, 0.5, 0.9):
        speed = path.EvalDerivative(1.5 * u)[1, 0]
        assert speed == pytest.approx(0.6 / 1.5 * 30 * u**2 * (1 - u) ** 2, rel=1e-9)
    assert path.value(0.75)[1, 0] == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize("num_points", [2, 3])
def test_path_turns_no_corner(num_points):
    """Velocity is continuous at every inner point, which the path passes at the time of its chord length."""
    path = load_path(MODELS / "paths" / "reach.yaml")
    path = TimedPath(path.points[:num_points], path.duration, path.tolerance)
    curve = path.build_trajectory()
    steps = np.linalg.norm(np.diff(path.points, axis=0, prepend=0.0), axis=1)
    for point, share in zip(path.points[:-1], np.cumsum(steps)[:-1] / steps.sum(), strict=True):
        time = path.duration * brentq(lambda u, share=share: 10 * u**3 - 15 * u**4 + 6 * u**5 - share, 0.0, 1.0)
        np.testing.assert_allclose(curve.value(time)[:, 0], point, atol=1e-9)
        came, goes = (curve.EvalDerivative(time + step)[:, 0] for step in (-1e-6, 1e-6))
        assert np.linalg.norm(came) > 0.1
        np.testing.assert_allclose(goes, came, atol=1e-4)


def test_an_error_as_large_as_the_tolerance_is_on_the_path():
    path = TimedPath(POINTS, duration=2.0, tolerance=0.01)
    assert path.describe_error(0.01) == ""
    assert path.describe_error(0.0101) == "leaves the path by 0.0101 m, must stay within 0.01 m"


@pytest.mark.parametrize(("duration", "slowest"), [(2.0, 8.0), (20.0, 40.0), (60.0, 60.0)])
def test_easier_paths_take_no_longer_than_a_path_may(duration, slowest):
    easier = [
        path for path, _ in TimedPath(POINTS, duration, tolerance=0.01).list_easier((1.0, 2.0, 4.0), (1.0, 0.5))
    ]
    assert max(path.duration for path in easier) == slowest
    assert {path.points[0][0] for path in easier} == {0.1, 0.05}


GOOD = "duration: 2.0\ntolerance: 0.02\npoints: [[0.1, 0, 0.2], [0.3, -0.1, 0.2]]\n"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("duration: 2.0", "duration: 0", "path.yaml: duration: is 0, must be from 0.05 to 60"),
        ("duration: 2.0", "", "duration: is missing"),
        ("duration: 2.0", "duration: 2.0\nspeed: 3", "speed: is not a key known here"),
        ("tolerance: 0.02", "tolerance: -1", "tolerance: is -1, must be from 0.0001 to 2"),
        ("[0.1, 0, 0.2]", "[0.1, 0]", "points[0]: is [0.1, 0], must be a list of 3 numbers"),
        ("[0.1, 0, 0.2]", "[0.1, .nan, 0.2]", "points[0][1]: is nan, must be from -2 to 2"),
        ("[0.1, 0, 0.2]", "[0, 0, 0]", "points[0]: is 0 m from the previous point"),
        ("[0.3, -0.1, 0.2]", "[0.1, 0, 0.2]", "points[1]: is 0 m from the previous point, must be at least 0.001"),
        ("[[0.1, 0, 0.2], [0.3, -0.1, 0.2]]", "[]", "points: is [], must be a list with at least one entry"),
    ],
)
def test_mistake_in_a_path_is_refused(tmp_path, old, new, said):
    path = tmp_path / "path.yaml"
    path.write_text(GOOD.replace(old, new))
    assert said in refuse(load_path, path)
