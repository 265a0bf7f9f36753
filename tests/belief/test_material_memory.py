import numpy as np
import pytest
from scipy.stats import truncnorm

from affordance.belief.density_belief import DensityBelief, Prior
from affordance.belief.material_memory import MaterialMemory

PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
BRASS, STEEL = (0.8, 0.6, 0.1), (0.5, 0.5, 0.6)


def test_new_looks_get_the_prior_and_known_ones_are_kept():
    known = MaterialMemory.from_belief((BRASS,), DensityBelief(np.array([[1e-4]]), np.array([0.85])))
    memory = known.add_colours([STEEL, BRASS, STEEL, (0.81, 0.59, 0.11)], PRIOR)  # the last looks like brass
    assert memory.colours == (BRASS, STEEL)
    np.testing.assert_allclose(memory.belief.untruncated_mean, [8500, 1000], rtol=1e-12)
    assert known.colours == (BRASS,)
    assert known.add_colours([(0.83, 0.6, 0.1)], PRIOR).belief.size == 2


@pytest.mark.parametrize(("mean", "sd"), [(5000.0, 300.0), (500.0, 1000.0)])
def test_density_is_that_of_a_normal_distribution_of_positive_values(mean, sd):
    belief = DensityBelief.from_moments(np.array([mean, 3000.0]), np.diag([sd, 100.0]) ** 2)
    found = MaterialMemory.from_belief((BRASS, STEEL), belief).density(BRASS)
    expected = truncnorm(-mean / sd, np.inf, loc=mean, scale=sd)
    assert found.mean == pytest.approx(expected.mean(), rel=1e-6)
    assert found.sd == pytest.approx(expected.std(), rel=1e-3)
    np.testing.assert_allclose(found[2:], expected.ppf([0.05, 0.25, 0.5, 0.75, 0.95]), rtol=1e-6)
