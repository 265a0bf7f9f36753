import numpy as np
import pytest
from scipy.stats import truncnorm

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory

COLOURS = ((0.8, 0.6, 0.1), (0.5, 0.5, 0.6))


@pytest.mark.parametrize(("mean", "sd"), [(5000.0, 300.0), (500.0, 1000.0)])
def test_density_is_that_of_a_normal_distribution_of_positive_values(mean, sd):
    belief = DensityBelief.from_moments(np.array([mean, 3000.0]), np.diag([sd, 100.0]) ** 2)
    found = MaterialMemory(COLOURS, belief).density(COLOURS[0])
    expected = truncnorm(-mean / sd, np.inf, loc=mean, scale=sd)
    assert found.mean == pytest.approx(expected.mean(), rel=1e-6)
    assert found.sd == pytest.approx(expected.std(), rel=1e-3)
    np.testing.assert_allclose(found[2:], expected.ppf([0.05, 0.25, 0.5, 0.75, 0.95]), rtol=1e-6)
