import numpy as np
import pytest

from affordance.extensions.payload.excitation.planned_motion import MotionLimits, compute_tip_speed, plan_way


@pytest.mark.parametrize(("acceleration", "tip_speed"), [(0.5, np.inf), (50.0, 0.2), (np.arange(1.0, 7.0), 1.0)])
def test_a_way_leads_from_rest_to_rest_within_its_limits(robot, acceleration, tip_speed):
    """One of the limits of each way is used to nine tenths and more, so that it takes no longer than it must."""
    six = np.ones(6)
    limits = MotionLimits(-3.0 * six, 3.0 * six, 2.0 * six, acceleration * six, 100.0 * six, tip_speed)
    start, end = np.zeros(6), np.array([1.0, -0.5, 0.3, 0.0, 2.0, -1.0])
    way = plan_way(robot, limits, start, end)
    np.testing.assert_allclose(way.q[[0, -1]], [start, end], atol=1e-12)
    np.testing.assert_allclose(np.vstack([way.v, way.vdot])[[0, len(way.v) - 1]], 0.0, atol=1e-12)
    shares = [
        np.abs(way.v / limits.v_max).max(),
        np.abs(way.vdot / limits.vdot_max).max(),
        compute_tip_speed(robot, way) / tip_speed,
    ]
    assert 0.9 < max(shares) <= 1.0
