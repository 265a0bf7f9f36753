import numpy as np
from numpy.testing import assert_allclose

from affordance.extensions.payload.evidence.fitted_arm import build_link_scale


def test_scale_of_inertias_has_their_units(robot):
    """Errors of mass, first and second moments scale as m, m L and m L^2, and are largest for the heaviest link."""
    scale = build_link_scale(robot).reshape(-1, 10)
    length = scale[:, 1] / scale[:, 0]
    assert_allclose(length, length[0])
    assert 0.01 < length[0] < 1.0
    assert_allclose(scale[:, 1:4], np.outer(scale[:, 0] * length, np.ones(3)))
    assert_allclose(scale[:, 4:], np.outer(scale[:, 0] * length**2, np.ones(6)))
    assert np.argmax(scale[:, 0]) == np.argmax(robot.link_parameters[:, 0])
