"""Evidence about one object: of its own densities, and of its materials."""

import numpy as np
import pytest

from affordance.belief.density_belief import Prior
from affordance.belief.felt_object import FeltObject
from affordance.belief.likelihood import Likelihood

WOOD, STEEL = (0.7, 0.5, 0.3), (0.5, 0.5, 0.5)


@pytest.mark.parametrize("deviation", [0.05, 0.3])
def test_object_tells_of_its_materials_what_its_deviation_from_them_leaves(deviation: float) -> None:
    """Errors of a measurement of own densities and deviations add up, as independent normal errors do."""
    error, felt = np.array([[120.0**2, -1.2e4], [-1.2e4, 200.0**2]]), np.array([700.0, 7800.0])
    precision = np.linalg.inv(error)
    own = Likelihood(precision, precision @ felt, 0.0)
    found = FeltObject.of((WOOD, STEEL), own, Prior(sd=4000.0, deviation=deviation), ())
    assert found is not None
    assert (found.colours, found.own) == ((WOOD, STEEL), own)
    own_sds = deviation * own.estimate_densities()
    np.testing.assert_allclose(np.linalg.inv(found.shared.precision), error + np.diag(own_sds**2), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.solve(found.shared.precision, found.shared.information_vector), felt)


def test_object_of_which_nothing_was_felt_tells_nothing() -> None:
    assert FeltObject.of((WOOD,), None, Prior(), ()) is None
