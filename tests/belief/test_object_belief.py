"""Beliefs about one object: samples of its body."""

import numpy as np
import pytest

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.objects.inertia import Geometry


@pytest.mark.parametrize("num_errors", [0, 2])
def test_sampled_bodies_scatter_by_densities_and_by_errors_of_geometry(num_errors: int) -> None:
    """A body is (Phi + sum_k e_k Phi_k) rho, with covariance Phi C Phi^T + sum_k Phi_k (C + rho rho^T) Phi_k^T.

    This is to first order: errors are of about one percent.
    """
    rng = np.random.default_rng(0)
    Phi, errors = rng.uniform(0.5, 1.5, (10, 2)), 0.01 * rng.standard_normal((num_errors, 10, 2))
    mean, C = np.array([2000.0, 6000.0]), np.array([[400.0**2, 3e4], [3e4, 500.0**2]])
    belief = ObjectBelief(MaterialMemory(), DensityBelief.from_moments(mean, C), Geometry(Phi, errors))
    np.testing.assert_allclose(belief.compute_parameters(mean), Phi @ mean)
    found = belief.draw_parameters(np.random.default_rng(1), 40_000)
    expected = Phi @ C @ Phi.T + sum(each @ (C + np.outer(mean, mean)) @ each.T for each in errors)
    sds = np.sqrt(np.diag(expected))
    np.testing.assert_allclose((found.mean(axis=0) - Phi @ mean) / sds, 0.0, atol=0.03)
    np.testing.assert_allclose((np.cov(found.T) - expected) / np.outer(sds, sds), 0.0, atol=0.03)
