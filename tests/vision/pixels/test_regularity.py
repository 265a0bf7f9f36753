import numpy as np
import pytest
from helpers.synthetic_pictures import make_ellipsoid
from scipy.spatial.transform import Rotation

from affordance.vision.pixels.ellipsoid_fit import Fit, SeenEllipsoid, deform
from affordance.vision.pixels.regularity import express_fit, straighten

ROD = make_ellipsoid([0.1, 0.02, 0.015], [0.1, 0.0, 0.0])


def draw_covariance(rng, scale=1.0):
    root = rng.standard_normal((9, 9)) * np.array([2e-4] * 3 + [5e-3] * 6)[:, None] * scale
    return root @ root.T


def test_fit_is_the_same_in_another_frame(rng):
    covariance = draw_covariance(rng)
    fit = Fit(ROD, covariance, 1.0, 100)
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


def test_part_that_may_be_straight_is(rng):
    covariance = draw_covariance(rng)
    for _ in range(20):
        seen = deform(ROD, np.linalg.cholesky(covariance) @ rng.standard_normal(9))
        fit = straighten(Fit(seen, covariance, 1.0, 100))
        np.testing.assert_array_equal(fit.ellipsoid.centre[1:], 0.0)
        np.testing.assert_array_equal(fit.ellipsoid.shape_matrix, np.diag(np.diag(fit.ellipsoid.shape_matrix)))
        assert np.linalg.eigvalsh(covariance - fit.covariance).min() > -1e-12  # nothing is less certain
        assert np.linalg.matrix_rank(fit.covariance, tol=1e-12) == 4


def test_errors_of_what_was_straightened_are_as_claimed(rng):
    """Of lengths along the axes and place along Tx, over many draws, against the conditioned covariance."""
    covariance = draw_covariance(rng, 0.5)
    errors = []
    for _ in range(2000):
        seen = deform(ROD, np.linalg.cholesky(covariance) @ rng.standard_normal(9))
        fit = straighten(Fit(seen, covariance, 1.0, 100))
        strains = 0.5 * np.log(np.diag(fit.ellipsoid.shape_matrix) / np.diag(ROD.shape_matrix))
        errors.append([fit.ellipsoid.centre[0] - ROD.centre[0], *strains])
    claimed = np.sqrt(np.diag(fit.covariance)[[0, 3, 4, 5]])
    np.testing.assert_allclose(np.std(errors, axis=0), claimed, rtol=0.12)


@pytest.mark.parametrize("crooked", [make_ellipsoid([0.1, 0.02, 0.015], [0.1, 0.01, 0.0]), None])
def test_part_that_is_clearly_crooked_is_left_alone(rng, crooked):
    if crooked is None:
        R = Rotation.from_rotvec([0.0, 0.0, 0.5]).as_matrix()
        crooked = SeenEllipsoid(ROD.centre, R @ ROD.shape_matrix @ R.T)
    fit = Fit(crooked, draw_covariance(rng, 0.2), 1.0, 100)
    assert straighten(fit) is fit
