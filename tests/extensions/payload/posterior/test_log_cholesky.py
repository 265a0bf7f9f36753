import numpy as np
import pytest
from numpy.testing import assert_allclose

from affordance.extensions.payload.posterior.log_cholesky import (
    compute_jacobian,
    is_possible,
    parameters_from_theta,
    theta_from_parameters,
)
from affordance.objects.inertia import pseudo_inertia_from_parameters


def test_every_theta_is_a_possible_body(rng):
    theta = rng.normal(0.0, 2.0, (500, 10))
    theta[:, 1:4] *= 0.3
    pi = parameters_from_theta(theta)
    assert is_possible(pi).all()
    assert (np.linalg.eigvalsh(pseudo_inertia_from_parameters(pi))[:, 0] > 0.0).all()


def test_conversion_there_and_back_changes_nothing(rng):
    theta = rng.normal(0.0, 0.5, (50, 10))
    assert_allclose(theta_from_parameters(parameters_from_theta(theta)), theta, atol=1e-9)


def test_jacobian_agrees_with_finite_differences(rng):
    theta = rng.normal(0.0, 0.5, 10)
    step = 1e-6
    columns = [
        (parameters_from_theta(theta + step * unit) - parameters_from_theta(theta - step * unit)) / (2.0 * step)
        for unit in np.eye(10)
    ]
    assert_allclose(compute_jacobian(theta), np.column_stack(columns), rtol=1e-6, atol=1e-8)


def test_impossible_bodies_are_told_and_have_no_theta():
    pi = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 3.0, 0.0, 0.0, 0.0])  # breaks the triangle inequality
    assert not is_possible(pi[None])[0]
    with pytest.raises(np.linalg.LinAlgError):
        theta_from_parameters(pi)
