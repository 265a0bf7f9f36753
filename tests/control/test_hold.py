import numpy as np
import pytest
from scipy.optimize import least_squares

from affordance.control.hold import Hold


def test_goal_is_the_posture_at_rest_whatever_the_state(model, arm, rng):
    hold = Hold(arm.home)
    for x in rng.normal(size=(3, 14)):
        model.set_state(x)
        goal = hold.compute_goal(model, x, 1.0, 0.24)
        np.testing.assert_array_equal(goal.C_q @ arm.home, goal.d_q)
        np.testing.assert_array_equal(goal.d_v, np.zeros(7))


@pytest.mark.parametrize("posture_weight", [1e-3, 1.0])
def test_posture_is_what_comes_closest_to_pose_and_posture(model, arm, rng, posture_weight):
    """Nonlinear least squares for both, from a state far away, finds nothing better than the posture itself."""

    def place(q):
        model.set_state(np.concatenate([q, np.zeros(7)]))
        return model.compute_hand_pose()

    X_WH = place(arm.home)

    def miss(q):
        X = place(q)
        pose = (X.GetAsMatrix34() - X_WH.GetAsMatrix34()).ravel()
        return np.concatenate([pose, posture_weight * (q - arm.home)])

    found = least_squares(miss, arm.home + 0.4 * rng.normal(size=7), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    goal = Hold(arm.home).compute_goal(model, np.zeros(14), 0.0, 0.24)
    np.testing.assert_allclose(found.x, goal.d_q, atol=1e-5)


def test_goal_cannot_be_changed_and_is_recognised(model, arm):
    hold = Hold(arm.home)
    goal = hold.compute_goal(model, np.zeros(14), 0.0, 0.24)
    assert hold.compute_goal(model, np.ones(14), 9.0, 0.24).C_q is goal.C_q
    with pytest.raises(ValueError, match="read-only"):
        goal.C_q[0, 0] = 2.0
