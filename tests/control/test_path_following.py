"""Following and carrying: goals against Newton's method, and motions against Drake's poses."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from affordance.control.path_following import Carrying, PathFollowing
from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS

P_TF = np.array([0.3, 0.0, 0.02])
HORIZON, NOW = 0.24, 0.7
CARRIED = TimedPath(points=((0.0, 0.1, 0.05),), duration=1.0, tolerance=0.02)
# Far from singular, as in paths/reach.yaml.
START = dict(load_path(MODELS / "paths" / "reach.yaml").start)


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


@pytest.fixture
def carrying(arm, model):
    q = arm.find_posture(START)
    model.set_posture(q)
    X_WH = model.compute_hand_pose().GetAsMatrix4()
    return Carrying(CARRIED.build_trajectory(), q_start=q, X_WHstart=X_WH)


def measure_miss(model, carrying, q, time):
    """Distance and angle from where the hand is to be, by Drake's pose."""
    model.set_posture(q)
    X_WH = model.compute_hand_pose()
    p_WH, _ = carrying.compute_reference(time)
    turn = Rotation.from_matrix(X_WH.rotation().matrix() @ carrying._R_WHstart.T).magnitude()
    return float(np.linalg.norm(X_WH.translation() - p_WH)), float(turn)


def test_goal_at_rest_at_the_start_is_the_start(arm, model, carrying):
    goal = carrying.compute_goal(model, np.concatenate([carrying.q_start, np.zeros(arm.num_joints)]), -1.0, 0.5)
    assert_allclose(goal.C_q @ carrying.q_start, goal.d_q, atol=1e-12)
    assert_allclose(goal.d_v, 0.0, atol=1e-12)


def test_repeated_steps_to_the_goal_lead_to_position_and_orientation(arm, model, carrying, rng):
    """Newton's method from 0.1 rad away reaches position and orientation to 1e-6 in four steps."""
    q, still = carrying.q_start + 0.1 * rng.standard_normal(arm.num_joints), np.zeros(arm.num_joints)
    misses = [measure_miss(model, carrying, q, 0.7)]
    for _ in range(4):
        goal = carrying.compute_goal(model, np.concatenate([q, still]), 0.7, 0.0)
        q = q + np.linalg.pinv(goal.C_q) @ (goal.d_q - goal.C_q @ q)
        misses.append(measure_miss(model, carrying, q, 0.7))
    assert min(misses[0]) > 0.01
    assert max(misses[-1]) < 1e-6


def test_rates_of_the_goal_move_the_hand_along_the_path_without_turning_it(arm, model, carrying):
    q = carrying.q_start
    goal = carrying.compute_goal(model, np.concatenate([q, np.zeros(arm.num_joints)]), 0.5, 0.0)
    model.set_posture(q)
    _, v_WH = carrying.compute_reference(0.5)
    assert_allclose(model.compute_hand_jacobian() @ goal.d_v, [0.0, 0.0, 0.0, *v_WH], atol=2e-3)
    assert np.linalg.norm(v_WH) > 0.1
