import numpy as np
from helpers.synthetic_pictures import make_ellipsoid
from scipy.spatial.transform import Rotation

from affordance.vision.pixels.ellipsoid_fit import Fit, deform, express_fit

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
