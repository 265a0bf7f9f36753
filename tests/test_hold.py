import numpy as np
import pytest

from affordance.tasks.hold import Hold


@pytest.fixture
def hold(model, arm):
    return Hold(model, arm.home)


def at(model, q):
    x = np.concatenate([q, np.zeros(7)])
    model.set_state(x)
    return x


def test_goal_in_the_posture_is_the_posture_at_rest(model, arm, hold):
    goal = hold.compute_goal(model, at(model, arm.home))
    np.testing.assert_allclose(goal.d_q, arm.home, atol=1e-12)
    np.testing.assert_array_equal(goal.d_v, np.zeros(7))
    np.testing.assert_array_equal(goal.C_q, np.eye(7))


def test_goal_nearby_is_the_posture_to_first_order(model, arm, hold, rng):
    direction = rng.normal(size=7)
    misses = []
    for size in (1e-2, 1e-3):
        goal = hold.compute_goal(model, at(model, arm.home + size * direction))
        misses.append(np.abs(goal.d_q - arm.home).max())
    assert misses[1] < misses[0] / 50


def test_pose_comes_before_posture_away_from_the_singularity(model, arm, rng):
    """In a bent arm: iterating the goal from a posture that cannot be kept restores the pose."""
    q_bent = arm.home + np.array([0.1, -0.2, 0.3, 1.0, 0.2, 0.3, 0.1])
    hold = Hold(model, q_bent)
    hold.q_posture = q_bent + 0.05 * rng.normal(size=7)
    q = q_bent + 0.1 * rng.normal(size=7)
    for _ in range(30):
        q = hold.compute_goal(model, at(model, q)).d_q
    at(model, q)
    error = model.compute_hand_pose().translation() - hold.X_WH.translation()
    # Without the pose term the hand would be off by what the posture is off.
    at(model, hold.q_posture)
    without = model.compute_hand_pose().translation() - hold.X_WH.translation()
    assert np.linalg.norm(error) < 0.3 * np.linalg.norm(without)


def test_pose_error_is_rotation_and_translation_to_the_goal(model, arm, hold, rng):
    q = arm.home + 0.2 * rng.normal(size=7)
    at(model, q)
    X_WH = model.compute_hand_pose()
    e = hold._error_map @ X_WH.GetAsMatrix34().ravel() + hold._error_offset
    np.testing.assert_allclose(e[3:], hold.X_WH.translation() - X_WH.translation(), atol=1e-14)
    turn = (hold.X_WH.rotation() @ X_WH.rotation().inverse()).ToAngleAxis()
    np.testing.assert_allclose(e[:3], np.sin(turn.angle()) * turn.axis(), atol=1e-14)


def test_goal_stays_calm_where_the_straight_arm_is_singular(model, arm, hold, rng):
    """However near to singular, the posture is corrected by at most what is missed over twice the damping."""
    for size in (1e-4, 1e-2, 0.3):
        for _ in range(30):
            q = arm.home + size * rng.normal(size=7)
            goal = hold.compute_goal(model, at(model, q))
            e = hold._error_map @ model.compute_hand_pose().GetAsMatrix34().ravel() + hold._error_offset
            missed = np.linalg.norm(e - model.compute_hand_jacobian() @ (arm.home - q))
            assert np.linalg.norm(goal.d_q - arm.home) <= missed / (2 * 0.05) + 1e-12
