import dataclasses

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram, SnoptSolver, SolverOptions

from affordance.control.constrained_qp import AccelerationProgram
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.problem import MpcSettings, TerminalGoal
from affordance.control.task import Hold
from affordance.exceptions import BadArgumentError
from affordance.plant.arm import JointLimits
from affordance.plant.arm_model import HeldTorqueModel
from affordance.settings import DEFAULT_SETTINGS

SETTINGS = DEFAULT_SETTINGS.mpc


@pytest.fixture
def mpc(arm):
    return MinimumAccelerationMpc(arm.limits, SETTINGS)


@pytest.fixture
def goal(arm, model):
    """Goal of a hold: rest at home."""
    return Hold(arm.home).compute_goal(model, np.zeros(14), 0.0, 0.24)


def draw_state(arm, rng, angle, rate):
    return np.concatenate([arm.home + angle * rng.normal(size=7), rate * rng.normal(size=7)])


def roll_out(vdot, x, T):
    """Angles and rates after each step of constant acceleration, integrated step by step."""
    h = T / len(vdot)
    q, v = np.split(np.array(x), 2)
    angles, rates = [], []
    for a in vdot:
        q = q + h * v + 0.5 * h**2 * a
        v = v + h * a
        angles.append(q)
        rates.append(v)
    return np.array(angles), np.array(rates)


def compute_cost(vdot, x, goal, settings):
    """The cost by its definition in mpc.py."""
    T = settings.horizon
    q, v = roll_out(vdot, x, T)
    e = np.concatenate([(goal.C_q @ q[-1] - goal.d_q) / T**2, (goal.C_v @ v[-1] - goal.d_v) / T])
    return (vdot**2).sum() / len(vdot) + settings.goal_weight * (e**2).sum()


def measure_overstep(vdot, x, limits, settings):
    """Largest overstep of the angles, s_q, and of the rates, s_v."""
    q, v = roll_out(vdot, x, settings.horizon)
    s_q = max(0.0, (q - limits.q_upper).max(), (limits.q_lower - q).max())
    return s_q, max(0.0, (np.abs(v) - limits.v_max).max())


def test_free_plan_predicts_its_own_motion(mpc, arm, rng, goal):
    x = draw_state(arm, rng, 0.1, 0.5)
    vdot, angles, rates = np.split(mpc.solve_free(x, goal), 3)
    q, v = roll_out(vdot, x, SETTINGS.horizon)
    np.testing.assert_allclose(angles, q, atol=1e-12)
    np.testing.assert_allclose(rates, v, atol=1e-12)


def test_free_plan_is_stationary_by_finite_differences(mpc, arm, rng, goal):
    x = draw_state(arm, rng, 0.1, 0.5)
    vdot = mpc.solve_free(x, goal)[: SETTINGS.num_steps]
    cost = compute_cost(vdot, x, goal, SETTINGS)
    for _ in range(20):
        direction = rng.normal(size=vdot.shape)
        step = 1e-3
        costs = [compute_cost(vdot + sign * step * direction, x, goal, SETTINGS) for sign in (1, -1)]
        assert min(costs) > cost
        assert abs(costs[0] - costs[1]) < 1e-6 * (costs[0] + costs[1] - 2 * cost)


def test_many_fine_steps_give_the_known_optimum_of_continuous_time(arm, rng):
    """The first acceleration is that of minimum-acceleration control, 6 dq / T^2 - 4 v / T, to 2 %."""
    settings = MpcSettings(horizon=0.4, num_steps=400, goal_weight=1e12)
    mpc = MinimumAccelerationMpc(arm.limits, settings)
    x = draw_state(arm, rng, 0.1, 0.5)
    one = np.eye(7)
    goal = TerminalGoal(one, arm.home, one, np.zeros(7))
    first = mpc.solve_free(x, goal)[0]
    expected = 6 * (arm.home - x[:7]) / 0.4**2 - 4 * x[7:] / 0.4
    np.testing.assert_allclose(first, expected, atol=0.02 * np.abs(expected).max())


def test_closed_form_equals_the_program_where_no_limit_is_active(mpc, arm, model, rng, goal):
    compared = 0
    for _ in range(60):
        x = draw_state(arm, rng, 0.05, 0.3)
        solution = mpc.solve(x, goal, model)
        if solution.status is MpcStatus.FREE:
            limited = mpc.solve_limited(x, goal, model)
            np.testing.assert_allclose(limited.vdot, solution.vdot, rtol=0, atol=1e-8)
            np.testing.assert_allclose(limited.tau, solution.tau, rtol=0, atol=1e-8)
            compared += 1
    assert compared > 20


def test_program_that_is_always_used_gives_the_same_plans_and_says_as_well_where_a_limit_is_active(
    mpc, arm, model, rng, monkeypatch, goal
):
    always = MinimumAccelerationMpc(arm.limits, dataclasses.replace(SETTINGS, always_program=True))
    monkeypatch.setattr(always, "solve_free", None)
    found = []
    for scale in np.linspace(0.02, 1.0, 40):
        x = draw_state(arm, rng, 0.1 * scale, 5.0 * scale)
        x[:7] = np.clip(x[:7], arm.limits.q_lower, arm.limits.q_upper)
        one, other = mpc.solve(x, goal, model), always.solve(x, goal, model)
        np.testing.assert_allclose(other.vdot, one.vdot, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(other.tau, one.tau, rtol=1e-6, atol=1e-7)
        assert other.status is one.status
        found.append(one.status)
    assert min(found.count(status) for status in (MpcStatus.FREE, MpcStatus.LIMITED)) > 5


def test_goal_of_fewer_rows_than_joints_is_met_and_equals_the_program(mpc, arm, model, rng):
    """A goal for a point of the hand, 3 rows of position and 3 of velocity, is met and equals the program's plan."""
    x = draw_state(arm, rng, 0.02, 0.1)
    x[arm.joint_names.index("elbow_flexion")] = 1.0  # a bent arm can move its hand in every direction
    model.set_state(x)
    J = model.compute_hand_jacobian()[3:]
    goal = TerminalGoal(J, J @ x[:7] + [0.0, 0.01, 0.005], J, np.zeros(3))
    solution = mpc.solve(x, goal, model)
    assert solution.status is MpcStatus.FREE
    q, v = roll_out(solution.vdot, x, SETTINGS.horizon)
    np.testing.assert_allclose(J @ q[-1], goal.d_q, atol=2e-5)
    np.testing.assert_allclose(J @ v[-1], goal.d_v, atol=2e-4)
    np.testing.assert_allclose(mpc.solve_limited(x, goal, model).vdot, solution.vdot, rtol=0, atol=1e-8)


def two_joints(**changes):
    limits = JointLimits(np.full(2, -1.0), np.full(2, 1.0), np.full(2, 2.0), np.full(2, 100.0))
    return limits._replace(**changes)


def solve_with_snopt(limits, x, goal, settings, *, M, bias, violation=(0.0, 0.0)):
    """Solution of the problem condensed to accelerations, all limits at once, by SNOPT's active-set method."""
    T, N = settings.horizon, settings.num_steps
    num = 2 * N
    free_q, free_v = roll_out(np.zeros((N, 2)), x, T)
    effects = [roll_out(unit.reshape(N, 2), np.zeros(4), T) for unit in np.eye(num)]
    S_q = np.array([q.ravel() for q, _ in effects]).T
    S_v = np.array([v.ravel() for _, v in effects]).T
    program = MathematicalProgram()
    z = program.NewContinuousVariables(num)
    E = np.vstack([S_q[-2:] / T**2, S_v[-2:] / T])
    e = np.concatenate([(free_q[-1] - goal.d_q) / T**2, (free_v[-1] - goal.d_v) / T])
    w = settings.goal_weight
    program.AddQuadraticCost(2 * (np.eye(num) / N + w * E.T @ E), 2 * w * E.T @ e, z)
    for S, free, lower, upper, s in (
        (S_q, free_q, limits.q_lower, limits.q_upper, violation[0]),
        (S_v, free_v, -limits.v_max, limits.v_max, violation[1]),
    ):
        program.AddLinearConstraint(S, np.tile(lower, N) - s - free.ravel(), np.tile(upper, N) + s - free.ravel(), z)
    program.AddLinearConstraint(M, -limits.tau_max - bias, limits.tau_max - bias, z[:2])
    options = SolverOptions()
    for name in ("Major optimality tolerance", "Major feasibility tolerance", "Minor feasibility tolerance"):
        options.SetOption(SnoptSolver.id(), name, 1e-9)
    result = SnoptSolver().Solve(program, np.zeros(num), options)
    assert result.is_success()
    return result.GetSolution(z).reshape(N, 2)


CASES = {
    "rate": (two_joints(v_max=np.array([2.0, 0.8])), [0.0, 0.0, 0.0, 0.0], [0.05, 0.2]),
    "angle": (two_joints(q_upper=np.array([1.0, 0.21])), [0.0, 0.15, 0.0, 1.0], [0.05, 0.2]),
    "torque": (two_joints(tau_max=np.array([1.0, 6.0])), [0.0, 0.0, 0.0, 0.0], [0.05, 0.2]),
    "goal beyond an angle": (two_joints(q_upper=np.array([1.0, 0.1])), [0.0, 0.0, 0.0, 0.0], [0.05, 0.9]),
    "goal too far for the rate": (two_joints(v_max=np.array([2.0, 1.0])), [0.0, 0.0, 0.0, 0.0], [0.05, 0.9]),
}


@pytest.mark.parametrize(("limits", "x", "d_q"), CASES.values(), ids=CASES)
def test_limited_plan_is_the_optimum_another_solver_finds(limits, x, d_q):
    settings = MpcSettings(horizon=0.3, num_steps=5, goal_weight=1e3)
    x = np.array(x)
    M, bias = np.array([[0.5, 0.1], [0.1, 0.2]]), np.array([0.3, -0.4])
    goal = TerminalGoal(np.eye(2), np.array(d_q), np.eye(2), np.zeros(2))
    free = MinimumAccelerationMpc(limits, settings).solve_free(x, goal)[:5]
    vdot = AccelerationProgram(limits, settings, (2, 2)).solve(x, goal, M=M, bias=bias, guess=free)
    found = solve_with_snopt(limits, x, goal, settings, M=M, bias=bias)
    costs = [compute_cost(plan, x, goal, settings) for plan in (vdot, found)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)
    np.testing.assert_allclose(vdot, found, atol=1e-3)
    assert max(measure_overstep(vdot, x, limits, settings)) < 1e-8
    assert (np.abs(M @ vdot[0] + bias) < limits.tau_max + 1e-8).all()
    # A limit is active, or the case would prove nothing.
    assert np.abs(vdot - free).max() > 0.1


def test_limits_that_cannot_be_kept_are_overstepped_as_little_as_possible():
    """A start beyond a limit is back within it in the second step at the earliest, whatever the goal."""
    settings = MpcSettings(horizon=0.3, num_steps=5, goal_weight=1e3)
    limits = two_joints(q_upper=np.array([-0.1, 1.0]))
    x = np.zeros(4)
    M, bias = np.array([[0.5, 0.1], [0.1, 0.2]]), np.zeros(2)
    goal = TerminalGoal(np.eye(2), np.array([0.5, 0.2]), np.eye(2), np.zeros(2))
    free = MinimumAccelerationMpc(limits, settings).solve_free(x, goal)[:5]
    vdot = AccelerationProgram(limits, settings, (2, 2)).solve(x, goal, M=M, bias=bias, guess=free)
    violation = measure_overstep(vdot, x, limits, settings)
    # In one step of 0.06 s at no more than 2 rad/s, and from rest, 0.06 of the 0.1 rad can be made good.
    assert violation[0] == pytest.approx(0.04, abs=1e-6)
    assert violation[1] < 1e-6
    found = solve_with_snopt(limits, x, goal, settings, M=M, bias=bias, violation=(0.04 + 1e-8, 1e-8))
    np.testing.assert_allclose(vdot, found, atol=0.05)


@pytest.mark.parametrize("T", [0.3, 3.0])
@pytest.mark.parametrize("lever", [1.9, 2.1])
def test_of_two_limits_that_cannot_both_be_kept_angles_count_by_t_squared_and_rates_by_t(T, lever):
    """One step, with joint 0 beyond its limit of angle, joint 1 beyond that of rate, and too little torque for both.

    By hand, with decelerations a and b: s_q = T^2 (0.1 - a) / 2 and s_v = T (0.2 - b), and the torque that the bias
    leaves is a + lever b <= 0.1. Keeping the angle, a = 0.1 and b = 0, makes s_q / T^2 + s_v / T = 0.2; keeping the
    rate, b = 0.2 and a = 0.1 - 0.2 lever, makes it 0.1 lever.
    """
    settings = MpcSettings(horizon=T, num_steps=1, goal_weight=1e3)
    far = 1e3
    limits = JointLimits(np.full(2, -far), np.array([-0.05 * T**2, far]), np.array([far, 1.0]), np.array([0.6, far]))
    M, bias = np.array([[1.0, lever], [lever, 10.0]]), np.array([-0.5, 0.0])
    goal = TerminalGoal(np.eye(2), np.full(2, 9.0), np.eye(2), np.full(2, 9.0))  # which pulls beyond both limits
    x = np.array([0.0, 0.0, 0.0, 1.0 + 0.2 * T])
    vdot = AccelerationProgram(limits, settings, (2, 2)).solve(x, goal, M=M, bias=bias, guess=np.zeros((1, 2)))
    expected = (0.0, 0.2 * T) if lever > 2.0 else (0.1 * lever * T**2, 0.0)
    assert measure_overstep(vdot, x, limits, settings) == pytest.approx(expected, abs=1e-6)
    assert np.abs(M @ vdot[0] + bias)[0] <= 0.6 + 1e-8


def test_goals_far_beyond_the_limits_do_not_move_the_arm_beyond_them(mpc, arm, model, at_home):
    """Goals up to 3 rad beyond the limits, from home, overstep angles by < 1e-7 rad and rates by < 1e-6 rad/s."""
    one = np.eye(7)
    for beyond in (0.03, 0.3, 3.0):
        for limit, sign in ((arm.limits.q_lower, -1.0), (arm.limits.q_upper, 1.0)):
            goal = TerminalGoal(one, limit + sign * beyond, one, np.zeros(7))
            solution = mpc.solve(at_home, goal, model)
            assert solution.status is MpcStatus.LIMITED
            s_q, s_v = measure_overstep(solution.vdot, at_home, arm.limits, SETTINGS)
            assert s_q < 1e-7
            assert s_v < 1e-6
            assert (np.abs(solution.tau) <= arm.limits.tau_max + 1e-7).all()


def test_torque_limits_are_always_kept(mpc, arm, model, rng, goal):
    limited = 0
    for _ in range(60):
        x = draw_state(arm, rng, 0.4, 3.0)
        solution = mpc.solve(x, goal, model)
        limited += solution.status is MpcStatus.LIMITED
        assert solution.status is not MpcStatus.FAILED
        assert (np.abs(solution.tau) <= arm.limits.tau_max + 1e-6).all()
        np.testing.assert_allclose(solution.tau, model.compute_inverse_dynamics(solution.vdot[0]), rtol=0, atol=1e-9)
    assert limited > 10


def test_joints_without_limits_are_left_alone(arm, model, rng, goal):
    unbounded = np.full(7, np.inf)
    mpc = MinimumAccelerationMpc(JointLimits(-unbounded, unbounded, unbounded, unbounded), SETTINGS)
    x = draw_state(arm, rng, 1.0, 10.0)
    solution = mpc.solve(x, goal, model)
    assert solution.status is MpcStatus.FREE
    np.testing.assert_allclose(mpc.solve_limited(x, goal, model).vdot, solution.vdot, rtol=0, atol=1e-6)


def test_result_does_not_depend_on_earlier_solves(mpc, arm, model, rng, goal):
    """A program is kept for goals of as many rows, and its solutions do not depend on what it solved before."""
    start, *others = (draw_state(arm, rng, 0.6, 6.0) for _ in range(3))
    first = mpc.solve(start, goal, model)
    assert first.status is MpcStatus.LIMITED
    program = mpc._programs[7, 7]
    for x in others:
        mpc.solve(x, goal, model)
        mpc.solve_limited(x, goal._replace(C_q=goal.C_q[:3], d_q=goal.d_q[:3]), model)
    np.testing.assert_array_equal(mpc.solve(start, goal, model).vdot, first.vdot)
    assert mpc._programs[7, 7] is program


@pytest.mark.parametrize("name", ["C_q", "C_v"])
@pytest.mark.parametrize("in_place", [True, False])
def test_plan_is_that_of_the_goal_as_it_is_now(mpc, arm, rng, name, in_place):
    """One matrix of the goal is changed, in place or for another; the other one stays and can never be changed."""
    matrices = {"C_q": np.eye(7), "C_v": np.eye(7)}
    for each, matrix in matrices.items():
        matrix.flags.writeable = each == name and in_place
    x, goal = draw_state(arm, rng, 0.1, 0.5), TerminalGoal(**matrices, d_q=arm.home, d_v=np.zeros(7))
    mpc.solve_free(x, goal)
    changed = getattr(goal, name) if in_place else np.eye(7)
    changed[0, 1] = 1.0
    goal = goal._replace(**{name: changed})
    expected = MinimumAccelerationMpc(arm.limits, SETTINGS).solve_free(x, goal)
    np.testing.assert_array_equal(mpc.solve_free(x, goal), expected)


def test_torque_that_is_held_over_a_control_period_is_within_the_limits(arm, goal, rng):
    """A limit that only the held torque exceeds, not that at the beginning of the period, is active."""
    model = HeldTorqueModel(arm, 0.02)
    x = draw_state(arm, rng, 0.1, 2.0)
    none = arm.limits._replace(tau_max=np.full(7, np.inf))
    vdot = MinimumAccelerationMpc(none, SETTINGS).solve_free(x, goal)[0]
    held = np.abs(model.compute_held_torque(x, vdot))
    model.set_state(x)
    begun = np.abs(model.compute_inverse_dynamics(vdot))
    joint = int(np.argmax(held - begun))
    assert held[joint] > begun[joint] + 0.01
    none.tau_max[joint] = 0.5 * (held + begun)[joint]
    for always in (False, True):
        settings = dataclasses.replace(SETTINGS, always_program=always)
        assert MinimumAccelerationMpc(none, settings).solve(x, goal, model).status is MpcStatus.LIMITED


@pytest.mark.parametrize(
    ("elapsed", "expected"),
    [(0.0, 1.0), (0.005, 1.0), (0.02, 2.0), ((0.01 + 0.06) - 0.01, 4.0), (0.235, 12.0), (0.24, 0.0), (9.0, 0.0)],
)
def test_earlier_plan_is_continued_step_by_step_and_then_coasts(mpc, elapsed, expected):
    """Of twelve steps of 0.02 s the fourth begins after 0.06 s, also if that is rounded to less."""
    vdot = np.arange(1.0, 13.0)[:, None] * np.ones(7)
    np.testing.assert_array_equal(mpc.continue_plan(vdot, elapsed), np.full(7, expected))


def test_state_that_is_not_finite_fails_without_torque(mpc, model, goal, at_home):
    at_home[3] = np.nan
    assert mpc.solve(at_home, goal, model).status is MpcStatus.FAILED


@pytest.mark.parametrize("name", ["horizon", "num_steps", "goal_weight"])
def test_settings_must_be_positive(name):
    with pytest.raises(BadArgumentError, match=f"MpcSettings: {name}: is 0, must be from "):
        dataclasses.replace(SETTINGS, **{name: 0})


@pytest.mark.parametrize("ratio", [1.0, 2.0, 4.0, 8.0, 16.0])
def test_sampled_loop_is_stable_for_a_believed_inertia_too_large_by(arm, ratio):
    """Poles of one joint have moduli below 0.999, the first acceleration times the ratio being held for a tick."""
    limits = JointLimits(*(limit[:1] for limit in arm.limits))
    mpc = MinimumAccelerationMpc(limits, SETTINGS)
    goal = TerminalGoal(np.eye(1), np.zeros(1), np.eye(1), np.zeros(1))
    K = np.array([mpc.solve_free(state, goal)[0, 0] for state in np.eye(2)])
    control_period = DEFAULT_SETTINGS.control_period
    A = np.array([[1.0, control_period], [0.0, 1.0]])
    B = np.array([0.5 * control_period**2, control_period])
    poles = np.linalg.eigvals(A + ratio * np.outer(B, K))
    assert np.abs(poles).max() < 0.999
