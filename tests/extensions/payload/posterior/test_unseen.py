import numpy as np
import pytest

from affordance.extensions.payload.posterior.solid_prior import SolidPrior
from affordance.extensions.payload.posterior.unseen import find_hidden_direction
from affordance.objects.inertia import compute_point_parameters

_PRIOR = SolidPrior.for_hand().draw_parameters(np.random.default_rng(1), 2000)
_DIRECTION = np.array([0.0, 0.6, 0.8])


@pytest.mark.parametrize("known", [True, False])
def test_the_direction_is_that_along_which_the_centre_of_mass_is_as_open_as_before(known):
    """Along y and z alone the spread is .6 and .8 of that of the direction, so that no coordinate is as open."""
    rng = np.random.default_rng(0)
    spread = (_PRIOR[:, 1:4] / _PRIOR[:, :1]).std(axis=0).max()
    along = 0.3 * spread if known else spread
    centres = 0.002 * rng.standard_normal((2000, 3)) + along * rng.standard_normal((2000, 1)) * _DIRECTION
    bodies = np.array([compute_point_parameters(centre) for centre in centres])
    found = find_hidden_direction(bodies, np.full(2000, 1.0 / 2000), _PRIOR)
    if known:
        assert found is None
    else:
        assert found == pytest.approx(_DIRECTION, abs=0.01)
