import numpy as np
import pytest
from numpy.testing import assert_allclose

from affordance.control.path_following import PathFollowing
from affordance.control.timed_path import TimedPath

P_TF = np.array([0.3, 0.0, 0.02])
HORIZON, NOW = 0.24, 0.7


@pytest.fixture
def task(model, arm):
    model.set_posture(arm.home)
    path = TimedPath(((0.1, 0.0, 0.2), (0.3, -0.1, 0.2)), duration=2.0, tolerance=0.01).build_trajectory()
    return PathFollowing(path, q_start=arm.home, p_WFstart=model.compute_point_position(P_TF), p_TF=P_TF)


def test_goal_is_the_place_on_the_path_when_the_horizon_ends(task, model, arm, rng):
    """C q - d is the distance of F from its place on the path, to 1e-9 m near the angles of an arm that coasts."""
    x = np.concatenate([arm.home + 0.1 * rng.standard_normal(7), 0.3 * rng.standard_normal(7)])
    model.set_state(x)
    goal = task.compute_goal(model, x, NOW, HORIZON)
    p_WFend, v_WFend = task.compute_reference(NOW + HORIZON)
    q_end = x[:7] + HORIZON * x[7:]
    for step in (np.zeros(7), 1e-5 * rng.standard_normal(7)):
        model.set_posture(q_end + step)
        assert_allclose(goal.C_q @ (q_end + step) - goal.d_q, model.compute_point_position(P_TF) - p_WFend, atol=1e-9)
    # The rates give F the path's velocity, traded against their size: a ridge regression of 1 cm.
    traded = np.linalg.lstsq(np.vstack([goal.C_q, 0.01 * np.eye(7)]), np.concatenate([v_WFend, np.zeros(7)]))[0]
    assert_allclose(goal.C_v @ traded, goal.d_v, atol=1e-9)
    assert_allclose(goal.C_v, np.eye(7))
