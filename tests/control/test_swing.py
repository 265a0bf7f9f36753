from dataclasses import replace

import numpy as np
import pytest
from helpers.two_tools import HELD
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

import affordance.control.swing as swing_module
from affordance.choice.hammer import load_hammer
from affordance.control.mpc import MinimumAccelerationMpc
from affordance.control.problem import MpcSettings, TerminalGoal
from affordance.control.swing import StrikeCondition, find_target, plan_swing
from affordance.exceptions import AffordanceError
from affordance.files.model_folder import MODELS
from affordance.plant.arm_model import ArmModel
from affordance.plant.contact import EffectiveMass
from affordance.plant.load import load_arm

DOWN = np.array([0.0, 0.0, -1.0])
OFFSET = np.array([-0.1, 0.0, -0.1])
START = dict(load_hammer(MODELS / "nail.yaml").start)


@pytest.fixture
def held():
    return HELD["wood"]


@pytest.fixture
def target(model, held):
    return find_target(
        model, held.components, q_start=model.arm.find_posture(START), offset_W=OFFSET, direction_W=DOWN
    )


def test_striking_point_is_the_lowest_of_the_free_part(model, held, target):
    model.set_posture(target.q_start)
    free = held.components[1]
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((2000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    surface = directions * free.shape.sizes
    places = [model.compute_point_position(free.X_TE[:3, 3] + free.X_TE[:3, :3] @ point)[2] for point in surface]
    lowest = model.compute_point_position(target.p_TS)[2]
    assert lowest <= min(places)
    assert lowest == pytest.approx(min(places), abs=1e-3)


@pytest.mark.parametrize("speed", [0.5, 2.0, 4.0])
def test_swing_strikes_where_and_as_it_is_to(model, target, speed):
    swing = plan_swing(model, target, speed=speed, duration=0.8)
    model.set_state(np.concatenate([swing.q_end, swing.v_end]))
    np.testing.assert_allclose(model.compute_point_position(target.p_TS), target.p_WS, atol=1e-6)
    np.testing.assert_allclose(model.compute_point_jacobian(target.p_TS) @ swing.v_end, speed * DOWN, atol=1e-5)
    normal_W = model.compute_hand_pose().rotation().matrix() @ target.normal_T
    np.testing.assert_allclose(normal_W, DOWN, atol=1e-5)


def test_swing_begins_at_rest_where_it_is_to_and_keeps_the_limits(model, target):
    swing = plan_swing(model, target, speed=4.0, duration=0.8)
    q, v, _ = swing.evaluate(np.linspace(0.0, 0.8, 81))
    np.testing.assert_allclose(q[0], model.arm.find_posture(START), atol=1e-12)
    np.testing.assert_allclose(v[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(q[-1], swing.q_end, atol=1e-12)
    np.testing.assert_allclose(v[-1], swing.v_end, atol=1e-12)
    limits = model.arm.limits
    assert (q >= limits.q_lower - 1e-3).all()
    assert (q <= limits.q_upper + 1e-3).all()
    assert (np.abs(v) <= limits.v_max).all()


def test_rates_and_accelerations_are_the_derivatives(model, target):
    swing = plan_swing(model, target, speed=2.0, duration=0.8)
    times, step = np.array([0.1, 0.4, 0.7]), 1e-5
    (_, v, vdot), (q1, v1, _), (q0, v0, _) = (swing.evaluate(times + shift) for shift in (0.0, step, -step))
    np.testing.assert_allclose((q1 - q0) / (2 * step), v, atol=1e-7)
    np.testing.assert_allclose((v1 - v0) / (2 * step), vdot, atol=1e-6)


def test_controller_of_minimum_acceleration_follows_the_swing_exactly(model, target):
    """A plan of 400 steps between two points of the swing has its accelerations to 0.2 %."""
    swing = plan_swing(model, target, speed=2.0, duration=0.8)
    mpc = MinimumAccelerationMpc(model.arm.limits, MpcSettings(horizon=0.24, num_steps=400, goal_weight=1e12))
    (q0, q1), (v0, v1), _ = swing.evaluate(np.array([0.3, 0.54]))
    goal = TerminalGoal(np.eye(7), q1, np.eye(7), v1)
    plan = mpc.solve_free(np.concatenate([q0, v0]), goal)[:400]
    middles = 0.3 + 0.24 / 400 * (np.arange(400) + 0.5)
    np.testing.assert_allclose(plan, swing.evaluate(middles)[2], atol=2e-3 * np.abs(plan).max())


def test_no_nearby_swing_has_less_acceleration(model, target):
    """Small steps that keep the strike, restored by Newton's method, raise the integral of squared acceleration."""
    D, n = 0.8, 7
    swing = plan_swing(model, target, speed=1.0, duration=D)

    def miss(z):
        model.set_posture(z[:n])
        place = model.compute_point_position(target.p_TS) - target.p_WS
        velocity = model.compute_point_jacobian(target.p_TS) @ z[n:] - 1.0 * DOWN
        normal = model.compute_hand_pose().rotation().matrix() @ target.normal_T
        return np.concatenate([place, velocity, normal[:2]])

    def slopes(z):
        return np.column_stack([(miss(z + h) - miss(z - h)) / 2e-6 for h in 1e-6 * np.eye(2 * n)])

    def cost(z):
        times = (np.arange(2000) + 0.5) * D / 2000
        _, _, vdot = swing._replace(q_end=z[:n], v_end=z[n:]).evaluate(times)
        return D / 2000 * np.sum(vdot**2)

    best = np.concatenate([swing.q_end, swing.v_end])
    assert (target.q_start == swing.q_start).all()
    least = cost(best)
    rng = np.random.default_rng(0)
    free = np.linalg.svd(slopes(best))[2][8:]
    # No limit is met, so that along what is free the cost has no slope.
    gradient = np.array([(cost(best + h) - cost(best - h)) / 2e-4 for h in 1e-4 * np.eye(2 * n)])
    assert np.linalg.norm(free @ gradient) < 1e-5 * np.linalg.norm(gradient)
    lower, upper = model.arm.limits.q_lower + np.radians(1.0), model.arm.limits.q_upper - np.radians(1.0)
    tried = 0
    for _ in range(40):
        z = best + 0.05 * rng.standard_normal(len(free)) @ free
        for _ in range(4):
            z = z - np.linalg.pinv(slopes(z)) @ miss(z)
        q, _, _ = swing._replace(q_end=z[:n], v_end=z[n:]).evaluate(np.linspace(0.0, D, 41))
        if (q >= lower - 1e-6).all() and (q <= upper + 1e-6).all():
            tried += 1
            assert cost(z) > least * (1.0 - 1e-6)
    assert tried >= 5


def test_strike_beyond_the_limits_is_refused(model, target):
    with pytest.raises(AffordanceError, match=r"no swing of 0.8 s within the joints' limits strikes with 40 m/s$"):
        plan_swing(model, target, speed=40.0, duration=0.8)


def test_effective_mass_is_that_of_an_impulse(model, held, target):
    """A unit impulse at the striking point changes its velocity along the blow by 1 / m, by Drake's own dynamics."""
    swing = plan_swing(model, target, speed=2.0, duration=0.8)
    mass = EffectiveMass(model, target.p_TS, target.direction_W, swing.q_end)
    heavy, light = mass.compute(np.array([held.parameters, np.zeros(10)]))
    assert light < heavy
    model.set_payload(held.parameters)
    model.set_posture(swing.q_end)
    J = model.compute_point_jacobian(target.p_TS)
    change = np.linalg.solve(model.compute_mass_matrix(), J.T @ DOWN)
    # Put back through inverse dynamics: the torques that this change of rates needs are those of the impulse.
    torque = model.compute_inverse_dynamics(change) - model.compute_inverse_dynamics(np.zeros(7))
    np.testing.assert_allclose(torque, J.T @ DOWN, atol=1e-9)
    assert DOWN @ J @ change == pytest.approx(1.0 / heavy, rel=1e-9)


def test_a_search_from_a_swing_nearby_finds_the_same(model, target):
    guess = plan_swing(model, target, speed=2.9, duration=0.8)
    found = plan_swing(model, target, speed=3.0, duration=0.8, guess=guess)
    expected = plan_swing(model, target, speed=3.0, duration=0.8)
    np.testing.assert_allclose(found.q_end, expected.q_end, atol=1e-4)
    np.testing.assert_allclose(found.v_end, expected.v_end, atol=1e-3)


@pytest.mark.parametrize("speed", [4.0, 12.0, 17.0])
def test_limits_that_enter_as_they_are_violated_give_the_swing_of_all_limits(model, target, monkeypatch, speed):
    guess = None
    for slower in np.arange(2.0, speed, 2.0):
        guess = plan_swing(model, target, speed=slower, duration=0.8, guess=guess)
    found = plan_swing(model, target, speed=speed, duration=0.8, guess=guess)
    nowhere = np.zeros(7, dtype=bool)
    monkeypatch.setattr(swing_module._Bounds, "find_within", lambda self, z, margin: nowhere)
    with_all = plan_swing(model, target, speed=speed, duration=0.8, guess=guess)
    np.testing.assert_allclose(np.hstack(found[1:3]), np.hstack(with_all[1:3]), atol=1e-4)


def test_limits_that_a_swing_keeps_anyway_change_nothing(target):
    """Rate limits 10 % above the rates of the free swing leave that swing as it is, to 1e-4 rad."""
    arm = load_arm()
    free = plan_swing(ArmModel(arm), target, speed=1.0, duration=0.8)
    _, v, _ = free.evaluate(np.linspace(0.0, 0.8, 801))
    v_max = 1.1 * np.abs(v).max(axis=0) + 0.05
    assert (v_max < arm.limits.v_max).any()
    narrow = replace(arm, limits=arm.limits._replace(v_max=np.minimum(v_max, arm.limits.v_max)))
    found = plan_swing(ArmModel(narrow), target, speed=1.0, duration=0.8)
    np.testing.assert_allclose(found.q_end, free.q_end, atol=1e-4)
    np.testing.assert_allclose(found.v_end, free.v_end, atol=1e-3)


@pytest.mark.parametrize("direction", [DOWN, -DOWN])
def test_gradient_of_the_strike_is_that_of_finite_differences(model, target, direction):
    """The gradient agrees with finite differences to 1e-7, also with the row for a face that has to be turned."""
    condition = StrikeCondition(model, target._replace(direction_W=direction), 1.0)
    rng = np.random.default_rng(0)
    for z in rng.normal(size=(5, 14)):
        found = ExtractGradient(condition.compute_with_gradient(InitializeAutoDiff(z).ravel()))
        steps = 1e-6 * np.eye(14)
        expected = np.array([condition.compute(z + step) - condition.compute(z - step) for step in steps]).T / 2e-6
        np.testing.assert_allclose(found, expected, atol=1e-7)
    assert len(condition.lower) == (8 if direction is DOWN else 9)
