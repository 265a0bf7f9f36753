"""Start postures of tasks: data of their files, and the rule by which they were chosen."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize

from affordance.choice.hammer import load_hammer
from affordance.choice.reach import Reach
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.control.problem import MpcSettings
from affordance.control.task import Hold, Task
from affordance.control.timed_path import load_path
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.rank_loss import MIN_MOBILITY, compute_mobility

REACH = MODELS / "paths" / "reach.yaml"
# 30 cm beyond the hand, where tools end.
P_TF = np.array([0.3, 0.0, 0.0])


def list_starts():
    """The starts of all tasks that have one."""
    return {
        "reach": load_path(REACH).start,
        "mash": load_path(MODELS / "paths" / "mash.yaml").start,
        "hammer": load_hammer(MODELS / "nail.yaml").start,
    }


def test_all_tasks_start_in_the_same_posture():
    starts = list_starts()
    assert len(set(starts.values())) == 1


def test_start_is_the_only_posture_nearest_to_the_middle_of_all_ranges(model):
    """Searches from random postures find none nearer to the middle with the hand straight ahead and level."""
    arm = model.arm
    lower, upper = arm.limits.q_lower, arm.limits.q_upper
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

    def compute_hand_axis(q):
        model.set_posture(q)
        return model.compute_hand_pose().rotation().matrix()[:, 0]

    def search(q):
        return minimize(
            lambda q: np.sum(((q - middle) / half) ** 2),
            q,
            method="SLSQP",
            bounds=list(zip(lower, upper, strict=True)),
            constraints={"type": "eq", "fun": lambda q: compute_hand_axis(q)[1:]},
            options={"maxiter": 300, "ftol": 1e-12},
        )

    rng = np.random.default_rng(0)
    ahead = []
    while len(ahead) < 5:
        found = search(rng.uniform(lower, upper))
        if found.success and compute_hand_axis(found.x)[0] > 0.0:  # the others point back
            ahead.append(found)
    least = min(ahead, key=lambda found: found.fun)
    nearest = [found for found in ahead if found.fun < least.fun + 1e-6]
    assert len(nearest) >= 3
    for found in nearest:
        np.testing.assert_allclose(found.x, arm.find_posture(dict(list_starts()["reach"])), atol=1e-3)


def test_start_is_farther_from_rank_loss_than_asked_for(model):
    mobility = compute_mobility(model, model.arm.find_posture(dict(list_starts()["reach"])), P_TF)
    assert mobility > 3.0 * MIN_MOBILITY


@pytest.mark.parametrize(
    ("file", "load"),
    [
        ("nail.yaml", lambda path: load_hammer(path).start),
        ("paths/reach.yaml", lambda path: load_path(path).start),
    ],
)
def test_start_is_the_home_posture_unless_said_otherwise(tmp_path, arm, file, load):
    lines = (MODELS / file).read_text().splitlines()
    (place,) = (number for number, line in enumerate(lines) if line.strip() == "start:")
    path = tmp_path / "task.yaml"
    path.write_text("\n".join(lines[:place]))
    assert load(path) == ()
    np.testing.assert_array_equal(arm.find_posture(dict(load(path))), arm.home)
    path.write_text("\n".join([*lines[: place + 1], "      elbow_flexion: 0.7"]))
    (posture,) = load(path)
    assert posture == ("elbow_flexion", 0.7)
    expected = np.array(arm.home)
    expected[arm.joint_names.index("elbow_flexion")] = 0.7
    np.testing.assert_array_equal(arm.find_posture(dict(load(path))), expected)


def test_reaching_from_an_outstretched_arm_is_refused_with_the_joint_to_bend(model):
    """Reaching from an outstretched arm is refused in one line that names a joint to bend."""
    outstretched = Reach(dataclasses.replace(load_path(REACH), start=()))
    with pytest.raises(
        AffordanceError, match=r"^the start moves the free end by 0 m per rad .* bend (\w+), "
    ) as caught:
        outstretched.begin(model, P_TF)
    assert "\n" not in str(caught.value)


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
