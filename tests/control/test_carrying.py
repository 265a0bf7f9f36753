"""Carrying: the goal against Newton's method, and the motion against Drake's poses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from affordance.control.path_following import Carrying
from affordance.control.timed_path import TimedPath, load_path
from affordance.files.model_folder import MODELS

PATH = TimedPath(points=((0.0, 0.1, 0.05),), duration=1.0, tolerance=0.02)
# Far from singular, as in paths/reach.yaml.
START = dict(load_path(MODELS / "paths" / "reach.yaml").start)


@pytest.fixture
def carrying(arm, model):
    q = arm.find_posture(START)
    model.set_posture(q)
    X_WH = model.compute_hand_pose().GetAsMatrix4()
    return Carrying(PATH.build_trajectory(), q_start=q, X_WHstart=X_WH)


def measure_miss(model, carrying, q, time):
    """Distance and angle from where the hand is to be, by Drake's pose."""
    model.set_posture(q)
    X_WH = model.compute_hand_pose()
    p_WH, _ = carrying.compute_reference(time)
    turn = Rotation.from_matrix(X_WH.rotation().matrix() @ carrying._R_WHstart.T).magnitude()
    return float(np.linalg.norm(X_WH.translation() - p_WH)), float(turn)


def test_goal_at_rest_at_the_start_is_the_start(arm, model, carrying):
    goal = carrying.compute_goal(model, np.concatenate([carrying.q_start, np.zeros(arm.num_joints)]), -1.0, 0.5)
    np.testing.assert_allclose(goal.C_q @ carrying.q_start, goal.d_q, atol=1e-12)
    np.testing.assert_allclose(goal.d_v, 0.0, atol=1e-12)


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
    np.testing.assert_allclose(model.compute_hand_jacobian() @ goal.d_v, [0.0, 0.0, 0.0, *v_WH], atol=2e-3)
    assert np.linalg.norm(v_WH) > 0.1
