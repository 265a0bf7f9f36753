"""Beliefs about one object: evidence of its own densities and of its materials, and samples of its body."""

import numpy as np
import pytest

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.likelihood import Likelihood
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import FeltObject, ObjectBelief
from affordance.objects.inertia import Geometry

WOOD, STEEL = (0.7, 0.5, 0.3), (0.5, 0.5, 0.5)


@pytest.mark.parametrize("deviation_sd", [50.0, 300.0])
def test_object_tells_of_its_materials_what_its_deviation_from_them_leaves(deviation_sd: float) -> None:
    """Errors of a measurement of own densities and deviations add up, as independent normal errors do."""
    error, felt = np.array([[120.0**2, -1.2e4], [-1.2e4, 200.0**2]]), np.array([700.0, 7800.0])
    precision = np.linalg.inv(error)
    own = Likelihood(precision, precision @ felt, 0.0)
    found = FeltObject.of((WOOD, STEEL), own, Prior(sd=4000.0, deviation_sd=deviation_sd), ())
    assert found is not None
    assert (found.colours, found.own) == ((WOOD, STEEL), own)
    np.testing.assert_allclose(np.linalg.inv(found.shared.precision), error + deviation_sd**2 * np.eye(2), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.solve(found.shared.precision, found.shared.information_vector), felt)


def test_object_of_which_nothing_was_felt_tells_nothing() -> None:
    assert FeltObject.of((WOOD,), None, Prior(), ()) is None


@pytest.mark.parametrize("num_errors", [0, 2])
def test_sampled_bodies_scatter_by_densities_and_by_errors_of_geometry(num_errors: int) -> None:
    """A body is (Phi + sum_k e_k Phi_k) rho, with covariance Phi C Phi^T + sum_k Phi_k (C + rho rho^T) Phi_k^T."""
    rng = np.random.default_rng(0)
    Phi, errors = rng.uniform(0.5, 1.5, (10, 2)), 0.1 * rng.standard_normal((num_errors, 10, 2))
    mean, C = np.array([2000.0, 6000.0]), np.array([[400.0**2, 3e4], [3e4, 500.0**2]])
    belief = ObjectBelief(MaterialMemory(), DensityBelief.from_moments(mean, C), Geometry(Phi, errors))
    np.testing.assert_allclose(belief.compute_parameters(mean), Phi @ mean)
    found = belief.draw_parameters(np.random.default_rng(1), 40_000)
    expected = Phi @ C @ Phi.T + sum(each @ (C + np.outer(mean, mean)) @ each.T for each in errors)
    sds = np.sqrt(np.diag(expected))
    np.testing.assert_allclose((found.mean(axis=0) - Phi @ mean) / sds, 0.0, atol=0.03)
    np.testing.assert_allclose((np.cov(found.T) - expected) / np.outer(sds, sds), 0.0, atol=0.03)
