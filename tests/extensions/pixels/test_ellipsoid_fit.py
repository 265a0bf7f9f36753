from unittest.mock import Mock

import numpy as np
import pytest
from helpers.refusals import refuse
from helpers.synthetic_pictures import CAMERA, NOISY, PERFECT, STAND, draw_picture, make_ellipsoid
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from affordance.arrays import build_symmetric
from affordance.extensions.pixels import ellipsoid_fit
from affordance.extensions.pixels.ellipsoid_fit import (
    Fit,
    PartView,
    SeenEllipsoid,
    UndeterminedError,
    deform,
    express_fit,
    fit_ellipsoid,
    guess,
    trace_rays,
)
from affordance.extensions.pixels.pipeline import collect_view, draw_outline
from affordance.extensions.pixels.segmentation import segment

BALL = make_ellipsoid([0.04, 0.04, 0.04], [0.02, -0.03, STAND - 0.04])
TURN = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
EGG = make_ellipsoid([0.03, 0.05, 0.08], [-0.04, 0.05, STAND - 0.09], TURN)
ROD = make_ellipsoid([0.1, 0.02, 0.015], [0.1, 0.0, 0.0])


def fit(ellipsoid, noise, rng=None):
    return fit_in(draw_picture([ellipsoid], [(0.7, 0.4, 0.2)]), noise, rng)


def fit_in(picture, noise, rng=None):
    if rng is not None:
        picture = noise.add_to(picture, CAMERA, rng)
    return fit_ellipsoid(collect_view(picture, segment(picture, STAND, noise), 0), CAMERA, noise)


def find_deformation(true, found):
    """The nine numbers that make one ellipsoid of another, to first order: E S + S E = dS in the axes of S."""
    squares, axes = np.linalg.eigh(true.shape_matrix)
    change = axes.T @ (found.shape_matrix - true.shape_matrix) @ axes
    E = axes @ (change / (squares[:, None] + squares[None])) @ axes.T
    return np.concatenate([found.centre - true.centre, E[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


@pytest.mark.parametrize("ellipsoid", [BALL, EGG])
def test_ellipsoid_is_recovered_exactly_from_perfect_depth(ellipsoid):
    found = fit(ellipsoid, PERFECT).ellipsoid
    np.testing.assert_allclose(found.centre, ellipsoid.centre, atol=1e-5)
    np.testing.assert_allclose(found.shape_matrix, ellipsoid.shape_matrix, atol=2e-4 * 0.08**2)


def test_points_sighted_lie_on_the_surface_and_on_their_rays(rng):
    pixels = CAMERA.project(EGG.centre[None]) + rng.uniform(-15.0, 15.0, (50, 2))
    seen = trace_rays(EGG, CAMERA.compute_rays(pixels), CAMERA.focal_length)
    np.testing.assert_allclose(CAMERA.project(seen.points), pixels, atol=1e-9)
    from_centre = seen.points - EGG.centre
    quadratic = np.einsum("ni,ij,nj->n", from_centre, np.linalg.inv(EGG.shape_matrix), from_centre)
    np.testing.assert_allclose(quadratic, 1.0, atol=1e-9)
    assert (seen.depth < EGG.centre[2]).all()  # the near side
    assert (seen.outline_distance > 0.0).all()


def test_outline_distance_is_counted_in_pixels():
    """The outline of a ball on the optical axis is a circle of known radius, with distances right to 0.08 pixels."""
    ball = make_ellipsoid([0.05] * 3, [0.0, 0.0, 0.8])
    radius = CAMERA.focal_length * 0.05 / np.sqrt(0.8**2 - 0.05**2)
    for offset in (-2.0, -0.5, 0.0, 0.5, 2.0):
        pixel = np.add(CAMERA.centre, (radius - offset, 0.0))
        distance = trace_rays(ball, CAMERA.compute_rays(pixel[None]), CAMERA.focal_length).outline_distance[0]
        assert distance == pytest.approx(offset, abs=0.08)


def test_deformations_are_affine_maps_of_the_surface(rng):
    numbers = 0.05 * rng.standard_normal(9)
    directions = rng.standard_normal((20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = EGG.centre + directions @ np.linalg.cholesky(EGG.shape_matrix).T
    moved = EGG.centre + numbers[:3] + (points - EGG.centre) @ (np.eye(3) + build_symmetric(numbers[3:]))
    deformed = deform(EGG, numbers)
    from_centre = moved - deformed.centre
    quadratic = np.einsum("ni,ij,nj->n", from_centre, np.linalg.inv(deformed.shape_matrix), from_centre)
    np.testing.assert_allclose(quadratic, 1.0, atol=1e-9)


def test_derivatives_agree_with_finite_differences(rng):
    pixels = CAMERA.project(EGG.centre[None]) + rng.uniform(-15.0, 15.0, (40, 2))
    rays = CAMERA.compute_rays(pixels)
    rim = CAMERA.compute_rays(draw_outline(EGG, CAMERA)[::8])
    problem = ellipsoid_fit._Problem(EGG, rays, np.full(40, 0.8), np.full(40, 1e-3), rim, NOISY, CAMERA.focal_length)
    steps = np.array([1e-7] * 3 + [1e-6] * 6 + [1e-4])
    for numbers in (np.zeros(10), np.append(np.zeros(9), 0.7)):
        changes = [
            (problem.compute_residuals(numbers + step) - problem.compute_residuals(numbers - step)) / step.max()
            for step in np.diag(steps)
        ]
        numeric = 0.5 * np.column_stack(changes)
        J = problem.compute_jacobian(numbers)
        np.testing.assert_allclose(J, numeric, atol=1e-5 * np.abs(numeric).max(axis=0).max())


def test_guess_is_near_enough_to_start_from():
    view = collect_view_of(EGG)
    first = guess(view, CAMERA)
    np.testing.assert_allclose(first.centre, EGG.centre, atol=0.02)
    volumes = [np.sqrt(np.linalg.det(ellipsoid.shape_matrix)) for ellipsoid in (first, EGG)]
    assert 0.5 < volumes[0] / volumes[1] < 2.0


def compute_size_prior(ellipsoid):
    """Half the squared deviations of the logarithms of the sizes: a factor of two is about one (0.68)."""
    sizes = np.sqrt(np.linalg.eigvalsh(ellipsoid.shape_matrix))
    return 0.5 * ((np.log(sizes / 0.05) / 0.7) ** 2).sum()


@pytest.mark.parametrize("ellipsoid", [EGG, ROD, make_ellipsoid([0.049, 0.05, 0.2], [0.0, 0.0, 0.6], TURN)])
def test_sizes_have_the_log_normal_prior_of_things_that_are_held(ellipsoid):
    """Its value, and its gradient by finite differences of the sizes of the deformed ellipsoid."""
    rays = CAMERA.compute_rays(np.array([[320.0, 240.0]]))
    problem = ellipsoid_fit._Problem(ellipsoid, rays, np.ones(1), np.ones(1), rays, NOISY, CAMERA.focal_length)
    of_sizes = problem.compute_residuals(np.zeros(10))[-4:-1]
    assert 0.5 * of_sizes @ of_sizes == pytest.approx(compute_size_prior(ellipsoid))
    gradient = problem.compute_jacobian(np.zeros(10))[-4:-1].T @ of_sizes
    changes = [
        compute_size_prior(deform(ellipsoid, step)) - compute_size_prior(deform(ellipsoid, -step))
        for step in 1e-5 * np.eye(9)
    ]
    np.testing.assert_allclose(gradient, [*np.array(changes) / 2e-5, 0.0], rtol=1e-6, atol=1e-8)


def test_a_shift_of_the_outline_by_its_standard_deviation_costs_one():
    rays = CAMERA.compute_rays(np.array([[320.0, 240.0]]))
    problem = ellipsoid_fit._Problem(BALL, rays, np.ones(1), np.ones(1), rays, NOISY, CAMERA.focal_length)
    assert [problem.compute_residuals(shift * np.eye(10)[9])[-1] for shift in (-1.0, 0.5)] == [-1.0, 0.5]


@pytest.mark.parametrize("thickness", [0.03, 0.08])
def test_thickness_of_which_nothing_is_seen_has_the_prior_of_sizes(thickness):
    """Nine readings around the middle do not show it: its logarithm is as uncertain as that of any size."""
    ball = make_ellipsoid([0.06, 0.05, thickness], [0.001, 0.002, 0.6])
    places = np.stack(np.meshgrid([-8.0, 0.0, 8.0], [-8.0, 0.0, 8.0]), axis=-1).reshape(-1, 2)
    pixels = CAMERA.project(ball.centre[None]) + places
    depth = trace_rays(ball, CAMERA.compute_rays(pixels), CAMERA.focal_length).depth
    found = fit_ellipsoid(PartView(pixels, depth, draw_outline(ball, CAMERA)), CAMERA, NOISY)
    xx, yy, zz = np.sqrt(np.diag(found.covariance)[3:6])
    assert zz == pytest.approx(0.7, rel=0.04)
    assert max(xx, yy) < 0.04


def collect_view_of(ellipsoid) -> PartView:
    picture = draw_picture([ellipsoid], [(0.7, 0.4, 0.2)])
    return collect_view(picture, segment(picture, STAND, PERFECT), 0)


@pytest.mark.parametrize("ellipsoid", [make_ellipsoid([0.03, 0.02, 0.025], [0.1, 0.05, STAND - 0.03]), EGG])
def test_errors_are_as_large_as_claimed(ellipsoid: SeenEllipsoid):
    """The mean chi^2 of nine numbers over 12 looks is 5 to 14; 9 is expected, with an SD of sqrt(18 / 12) = 1.2."""
    squares, picture = [], draw_picture([ellipsoid], [(0.7, 0.4, 0.2)])
    for seed in range(12):
        found = fit_in(picture, NOISY, np.random.default_rng(seed))
        error = find_deformation(ellipsoid, found.ellipsoid)
        squares.append(error @ np.linalg.solve(found.covariance, error))
        assert 0.7 < found.misfit < 1.3
    assert 5.0 < np.mean(squares) < 14.0


def test_axis_along_the_view_is_the_least_certain():
    covariance = fit(BALL, NOISY, np.random.default_rng(1)).covariance
    xx, yy, zz = np.diag(covariance)[3:6]
    assert zz > 4.0 * max(xx, yy)


def test_readings_of_something_else_are_left_out():
    picture = draw_picture([EGG], [(0.7, 0.4, 0.2)])
    segmentation = segment(picture, STAND, NOISY)
    clean = fit_ellipsoid(collect_view(picture, segmentation, 0), CAMERA, NOISY)
    rows, columns = np.nonzero(segmentation.labels == 0)
    picture.depth[rows[::50], columns[::50]] -= 0.05
    spoilt = fit_ellipsoid(collect_view(picture, segmentation, 0), CAMERA, NOISY)
    np.testing.assert_allclose(spoilt.ellipsoid.centre, clean.ellipsoid.centre, atol=3e-4)


def test_readings_on_a_line_determine_no_ellipsoid():
    pixels = np.column_stack([np.arange(300.0, 340.0), np.full(40, 240.0)])
    view = PartView(pixels, np.full(40, 0.8), pixels)
    said = refuse(fit_ellipsoid, view, CAMERA, NOISY, error=UndeterminedError)
    assert "40 readings of a part lie on a line, must cover an area" in said


def test_readings_that_contradict_each_other_determine_no_ellipsoid(rng):
    view = collect_view_of(BALL)
    torn = view._replace(depth=rng.uniform(0.3, 3.0, len(view.depth)), outline=view.outline[:9])
    assert "part" in refuse(fit_ellipsoid, torn, CAMERA, PERFECT, error=UndeterminedError)


def test_fit_that_does_not_end_is_none(monkeypatch):
    monkeypatch.setattr(ellipsoid_fit, "least_squares", lambda *args, **kw: least_squares(*args, **kw, max_nfev=1))
    with pytest.raises(
        UndeterminedError, match="the fit of an ellipsoid to a part does not converge: The maximum number"
    ):
        fit(EGG, NOISY, np.random.default_rng(0))


def test_singular_matrix_is_no_fit(monkeypatch):
    monkeypatch.setattr(ellipsoid_fit, "least_squares", Mock(side_effect=np.linalg.LinAlgError("Singular matrix")))
    with pytest.raises(UndeterminedError, match="does not determine an ellipsoid: Singular matrix"):
        fit(EGG, NOISY, np.random.default_rng(0))


def test_fit_is_the_same_in_another_frame(rng):
    root = rng.standard_normal((9, 9)) * np.array([2e-4] * 3 + [5e-3] * 6)[:, None]
    covariance = root @ root.T
    fit = Fit(ROD, covariance, 1.0)
    X_TC = np.eye(4)
    X_TC[:3, :3], X_TC[:3, 3] = Rotation.from_rotvec([0.3, 1.0, -0.4]).as_matrix(), [0.1, 0.2, 0.3]
    turned = express_fit(fit, X_TC)
    np.testing.assert_allclose(express_fit(turned, np.linalg.inv(X_TC)).covariance, covariance, atol=1e-12)
    # A deformation commutes with the change of frame; the covariance of both is one and the same.
    numbers = np.linalg.cholesky(covariance)[:, 4]
    one = express_fit(fit._replace(ellipsoid=deform(ROD, numbers), covariance=np.outer(numbers, numbers)), X_TC)
    squares, directions = np.linalg.eigh(one.covariance)
    other = directions[:, -1] * np.sqrt(squares[-1])
    found = [deform(turned.ellipsoid, sign * other).shape_matrix for sign in (1.0, -1.0)]
    assert min(np.abs(shape - one.ellipsoid.shape_matrix).max() for shape in found) < 1e-12
