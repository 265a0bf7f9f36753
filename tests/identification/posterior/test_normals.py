import numpy as np
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal

from affordance.identification.posterior.solid_prior import Normals


def test_squares_and_scales_are_those_of_the_densities(rng):
    roots = rng.standard_normal((3, 4, 4))
    normals = Normals(rng.standard_normal((3, 4)), roots @ roots.swapaxes(1, 2) + 0.1 * np.eye(4))
    points = rng.standard_normal((7, 4))
    ours = normals.log_scales - 0.5 * normals.measure_squares(points) - 2.0 * np.log(2.0 * np.pi)
    for k, (mean, covariance) in enumerate(zip(normals.means, normals.covariances, strict=True)):
        assert_allclose(ours[:, k], multivariate_normal(mean, covariance).logpdf(points), rtol=1e-9)
    assert_allclose(normals.precisions @ normals.covariances, np.tile(np.eye(4), (3, 1, 1)), atol=1e-8)
