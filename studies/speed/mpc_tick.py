"""Times one control period of the controller, compared with the algebra alone and with other solvers.

If no limit is active, the baseline is the closed form alone: it solves for the multipliers of the terminal goal, and
multiplies out the accelerations. It is timed for a changing goal, with a factorisation in every control period, and
for a constant goal as in this task, with a stored inverse. The control period is everything that the system does at
an event, at states that it has not met before: it reads the state, finds the goal, plans, checks the limits over the
whole plan, and computes torques.

If limits are active, the baseline is OSQP at 1e-6 with a reused program in the formulation that suits OSQP best:
accelerations only, with hard goal and limits. That program is not always feasible; times are compared only for states
where it is.
"""

from collections.abc import Callable

import numpy as np
from pydrake.solvers import ChooseBestSolver, MakeSolver, MathematicalProgram, OsqpSolver, SolverOptions

from affordance.arrays import Array
from affordance.control.hold import Hold
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.problem import MpcSettings, TerminalGoal, compute_responses
from affordance.plant.arm import JointLimits
from affordance.plant.arm_model import ArmModel
from affordance.plant.load import load_arm
from affordance.settings import DEFAULT_SETTINGS
from studies.speed.timing import time_by_turns

NUM_FREE = 100
NUM_LIMITED = 40
HEADER = ["limits active", "control period", "us"]


def build_bare_algebra(
    settings: MpcSettings, num_joints: int, *, keeps_inverse: bool
) -> Callable[[Array, TerminalGoal], Array]:
    """Builds the closed form without checks: multipliers of the goal first, then accelerations."""
    angle, rate = compute_responses(settings)
    one = np.eye(num_joints)
    G = np.vstack([np.kron(angle[-1], one), np.kron(rate[-1], one)])
    gram, T = G @ G.T, settings.horizon
    gain = G.T @ np.linalg.inv(gram)

    def solve(x: Array, goal: TerminalGoal) -> Array:
        q, v = x[:num_joints], x[num_joints:]
        missing = np.concatenate([goal.d_q - q - T * v, goal.d_v - v])
        vdot: Array = gain @ missing if keeps_inverse else G.T @ np.linalg.solve(gram, missing)
        return vdot

    return solve


def build_equality_solver(settings: MpcSettings, num_joints: int) -> Callable[[Array, TerminalGoal], Array]:
    """Builds the same plan as a reused program for the equality-constrained solver that Drake chooses."""
    N, T = settings.num_steps, settings.horizon
    one = np.eye(num_joints)
    terminal = np.vstack([np.kron(response[-1], one) for response in compute_responses(settings)])
    program = MathematicalProgram()
    vdot = program.NewContinuousVariables(N * num_joints)
    program.AddQuadraticCost(2.0 / N * np.eye(N * num_joints), np.zeros(N * num_joints), vdot, is_convex=True)
    reached = program.AddLinearEqualityConstraint(terminal, np.zeros(2 * num_joints), vdot).evaluator()
    solver = MakeSolver(ChooseBestSolver(program))

    def solve(x: Array, goal: TerminalGoal) -> Array:
        q, v = x[:num_joints], x[num_joints:]
        reached.UpdateCoefficients(terminal, np.concatenate([goal.d_q - q - T * v, goal.d_v - v]))
        planned: Array = solver.Solve(program).GetSolution(vdot)
        return planned

    return solve


class HardOsqp:
    """Reusable program of accelerations only, with hard goal and limits, solved by OSQP at 1e-6."""

    def __init__(self, limits: JointLimits, settings: MpcSettings) -> None:
        """Builds the program."""
        N, n = settings.num_steps, len(limits.tau_max)
        self._limits, self._horizon, self._num_steps = limits, settings.horizon, N
        angle, rate = compute_responses(settings)
        one = np.eye(n)
        self._motion = np.vstack([np.kron(angle, one), np.kron(rate, one)])
        self._terminal = np.vstack([np.kron(angle[-1], one), np.kron(rate[-1], one)])
        program = MathematicalProgram()
        vdot = program.NewContinuousVariables(N * n)
        program.AddQuadraticCost(2.0 / N * np.eye(N * n), np.zeros(N * n), vdot, is_convex=True)
        unbounded = np.full(2 * N * n, np.inf)
        self._limit = program.AddLinearConstraint(self._motion, -unbounded, unbounded, vdot)
        self._goal = program.AddLinearEqualityConstraint(self._terminal, np.zeros(2 * n), vdot)
        self._torque = program.AddLinearConstraint(one, -np.ones(n), np.ones(n), vdot[:n])
        self._program, self._vdot = program, vdot
        self._options = SolverOptions()
        for name, value in (("eps_abs", 1e-6), ("eps_rel", 1e-6)):
            self._options.SetOption(OsqpSolver.id(), name, value)
        self._options.SetOption(OsqpSolver.id(), "max_iter", 20_000)

    def solve(self, x: Array, goal: TerminalGoal, M: Array, bias: Array) -> Array | None:
        """Computes the accelerations, (N n,); returns None if OSQP does not succeed."""
        n, N, T = len(bias), self._num_steps, self._horizon
        q, v = x[:n], x[n:]
        times = np.arange(1, N + 1) * T / N
        drift = np.concatenate([(q + times[:, None] * v).ravel(), np.tile(v, N)])
        limits = self._limits
        lower = np.concatenate([np.tile(limits.q_lower, N), np.tile(-limits.v_max, N)]) - drift
        upper = np.concatenate([np.tile(limits.q_upper, N), np.tile(limits.v_max, N)]) - drift
        self._limit.evaluator().UpdateCoefficients(self._motion, lower, upper)
        missing = np.concatenate([goal.d_q - q - T * v, goal.d_v - v])
        self._goal.evaluator().UpdateCoefficients(self._terminal, missing)
        self._torque.evaluator().UpdateCoefficients(M, -limits.tau_max - bias, limits.tau_max - bias)
        result = OsqpSolver().Solve(self._program, None, self._options)
        return result.GetSolution(self._vdot) if result.is_success() else None


def draw_limited(
    mpc: MinimumAccelerationMpc, hold: Hold, model: ArmModel, osqp: HardOsqp
) -> list[tuple[Array, TerminalGoal, Array, Array]]:
    """Draws states in which a limit is active and the hard problem has a solution."""
    rng = np.random.default_rng(0)
    home = model.arm.home
    cases: list[tuple[Array, TerminalGoal, Array, Array]] = []
    while len(cases) < NUM_LIMITED:
        x = np.concatenate([home + 0.2 * rng.normal(size=len(home)), 1.5 * rng.normal(size=len(home))])
        model.set_state(x)
        goal = hold.compute_goal(model, x, 0.0, 0.24)
        if mpc.solve(x, goal, model).status is MpcStatus.LIMITED:
            M, bias = model.compute_mass_matrix(), model.compute_inverse_dynamics(np.zeros(len(home)))
            if osqp.solve(x, goal, M, bias) is not None:
                cases.append((x, goal, M, bias))
    return cases


def measure() -> tuple[list[list[str]], dict[str, float]]:
    """Times the control periods; returns rows of a table, and the ratios."""
    arm, settings = load_arm(), DEFAULT_SETTINGS.mpc
    model = ArmModel(arm)
    mpc, hold = MinimumAccelerationMpc(arm.limits, settings), Hold(arm.home)
    factorising, keeping = (
        build_bare_algebra(settings, arm.num_joints, keeps_inverse=keeps) for keeps in (False, True)
    )
    by_drake = build_equality_solver(settings, arm.num_joints)
    rng = np.random.default_rng(0)
    states = [
        np.concatenate([arm.home + 0.01 * rng.normal(size=len(arm.home)), 0.02 * rng.normal(size=len(arm.home))])
        for _ in range(NUM_FREE)
    ]
    goal = hold.compute_goal(model, states[0], 0.0, 0.24)

    def control_period() -> None:
        for x in states:
            model.set_state(x)
            mpc.solve(x, hold.compute_goal(model, x, 0.0, 0.24), model)

    def repeat(call: Callable[[Array, TerminalGoal], object]) -> Callable[[], None]:
        def run() -> None:
            for x in states:
                call(x, goal)

        return run

    for x in states:
        model.set_state(x)
        solution = mpc.solve(x, goal, model)
        assert solution.status is MpcStatus.FREE
        for other in (factorising, keeping, by_drake):  # all must give the same plan
            np.testing.assert_allclose(other(x, goal), solution.vdot.ravel(), atol=1e-4)
    free = time_by_turns(
        {
            "algebra alone, factorised in every period": repeat(factorising),
            "algebra alone, stored inverse": repeat(keeping),
            "Drake's equality-constrained solver, stored program": repeat(by_drake),
            "plan and its motion": repeat(mpc.solve_free),
            "control period: state, goal, plan, limits, torques": control_period,
        },
        calls_per_turn=5,
    )
    free = {name: value / NUM_FREE for name, value in free.items()}

    osqp = HardOsqp(arm.limits, settings)
    cases = draw_limited(mpc, hold, model, osqp)

    def solve_ours() -> None:
        for x, goal, _, _ in cases:
            model.set_state(x)
            mpc.solve(x, goal, model)

    def solve_osqp() -> None:
        for x, goal, M, bias in cases:
            osqp.solve(x, goal, M, bias)

    limited = time_by_turns({"ours": solve_ours, "OSQP at 1e-6": solve_osqp}, turns=7, calls_per_turn=1)
    limited = {name: value / NUM_LIMITED for name, value in limited.items()}
    rows = [["none", name, f"{1e6 * value:.1f}"] for name, value in free.items()]
    rows += [["some", name, f"{1e6 * value:.0f}"] for name, value in limited.items()]
    whole = free["control period: state, goal, plan, limits, torques"]
    return rows, {
        "mpc_tick_vs_algebra": whole / free["algebra alone, factorised in every period"],
        "mpc_tick_vs_kept_algebra": whole / free["algebra alone, stored inverse"],
        "mpc_tick_vs_drake_solver": whole / free["Drake's equality-constrained solver, stored program"],
        "mpc_limits_vs_osqp": limited["ours"] / limited["OSQP at 1e-6"],
    }
