import numpy as np
import pytest
from scipy.optimize import lsq_linear

from affordance.control.hold import Hold
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.control.problem import MpcSettings
from affordance.control.task import Task


def test_arm_comes_back_as_optimal_control_in_continuous_time_says(model, arm, rng):
    """A displaced arm returns as q'' = -6 d / T^2 - 4 d' / T has it in closed form, to 3 % of the displacement.

    On the way angles are off by up to the whole displacement, and the hand by centimetres.
    """
    T, tick = 0.24, 0.002
    mpc = MinimumAccelerationMpc(arm.limits, MpcSettings(horizon=T, num_steps=120, goal_weight=1e10))
    hold = Hold(arm.home)
    displacement = 0.1 * rng.uniform(-1.0, 1.0, 7)
    q, v, places, found = arm.home + displacement, np.zeros(7), [], []
    for k in range(round(1.0 / tick) + 1):
        x = np.concatenate([q, v])
        model.set_state(x)
        places.append(model.compute_hand_pose().translation())
        found.append(q - arm.home)
        vdot = mpc.solve_free(x, hold.compute_goal(model, x, k * tick, T))[0]
        q, v = q + tick * v + 0.5 * tick**2 * vdot, v + tick * vdot
    t = tick * np.arange(len(found)) / T
    decay = np.exp(-2.0 * t) * (np.cos(np.sqrt(2.0) * t) + np.sqrt(2.0) * np.sin(np.sqrt(2.0) * t))
    np.testing.assert_allclose(found, np.outer(decay, displacement), atol=0.03 * np.abs(displacement).max())
    model.set_posture(arm.home)
    missed = np.linalg.norm(places - model.compute_hand_pose().translation(), axis=1)
    assert missed[0] > 0.02
    assert missed[-1] < 1e-3


def test_posture_that_cannot_be_reached_is_come_as_near_as_the_goals_weights_say(model, arm):
    """Joints too slow to return within the horizon end with the least weighted error of angle and rate.

    Each joint is one of its own, and goes at its limit: bounded least squares of scipy, over the accelerations.
    """
    T, N = 0.24, 12
    settings = MpcSettings(horizon=T, num_steps=N)
    slow = arm.limits._replace(v_max=np.full(7, 0.3))
    q = arm.home.copy()
    bent = arm.joint_names.index("elbow_flexion")
    q[bent] += 0.4
    x = np.concatenate([q, np.zeros(7)])
    model.set_state(x)
    plan = MinimumAccelerationMpc(slow, settings).solve(x, Hold(arm.home).compute_goal(model, x, 0.0, T), model)
    rates = np.cumsum(plan.vdot, axis=0) * T / N
    angles = q + np.cumsum((rates - 0.5 * plan.vdot * T / N) * T / N, axis=0)

    # In terms of rates r_1 .. r_N after the steps, whose bounds are those of the variables.
    differences = (np.eye(N) - np.eye(N, k=-1)) * N / T / np.sqrt(N)  # accelerations over sqrt(N)
    weight = np.sqrt(settings.goal_weight)
    travelled = np.full(N, T / N)
    travelled[-1] *= 0.5
    rows = np.vstack([differences, weight * travelled / T**2, weight * np.eye(N)[-1] / T])
    wanted = np.concatenate([np.zeros(N), [-weight * 0.4 / T**2, 0.0]])
    expected = lsq_linear(rows, wanted, (-0.3, 0.3), tol=1e-14).x
    np.testing.assert_allclose(rates[:, bent], expected, atol=1e-5)
    residual = angles[-1, bent] - arm.home[bent]
    assert 0.3 < residual < 0.4
    np.testing.assert_allclose(np.delete(plan.vdot, bent, axis=1), 0.0, atol=1e-6)


def test_goal_cannot_be_changed_and_is_recognised(model, arm):
    hold = Hold(arm.home)
    goal = hold.compute_goal(model, np.zeros(14), 0.0, 0.24)
    assert hold.compute_goal(model, np.ones(14), 9.0, 0.24).C_q is goal.C_q
    with pytest.raises(ValueError, match="read-only"):
        goal.C_q[0, 0] = 2.0


def test_what_states_its_goals_is_a_task(arm):
    assert isinstance(Hold(arm.home), Task)
    assert not isinstance(arm, Task)
