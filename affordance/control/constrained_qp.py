"""Quadratic program for minimum joint acceleration within limits (the problem is defined in mpc.py).

The decision variables are accelerations; angles and rates after each step are linear functions of them. Few of the
many limits of angle and rate become active. A limit is therefore added only if the previous solution violates it.
A solution that violates no further limit is the optimum of the full program. If no plan satisfies all limits, for
example because the arm is already beyond a limit, a linear program first finds the smallest violation.
"""

import numpy as np
from pydrake.solvers import ClarabelSolver, DaqpSolver, MathematicalProgram, SolverOptions

from affordance.arrays import Array
from affordance.control.problem import MpcSettings, TerminalGoal, compute_responses
from affordance.plant.arm import JointLimits

# Tolerances of the solvers. They are four orders of magnitude below the defaults of 1e-6 and 1e-8, so that plans
# agree with the closed form to 1e-8 (tests/control/test_mpc.py).
_PLAN_TOLERANCE, _RESCUE_TOLERANCE = 1e-10, 1e-12
# Largest violation of a limit that is attributed to rounding errors, [rad] and [rad/s].
LIMIT_TOLERANCE = 1e-9


class AccelerationProgram:
    """Quadratic program for goals with given numbers of rows, which is built once and solved many times."""

    def __init__(self, limits: JointLimits, settings: MpcSettings, num_goal_rows: tuple[int, int]) -> None:
        """Builds the programs.

        Args:
            limits: Joint limits.
            settings: Settings of the controller.
            num_goal_rows: Numbers of rows of goals for angles and rates, (m_q, m_v).
        """
        N, T, n = settings.num_steps, settings.horizon, len(limits.tau_max)
        self._limits = limits
        self._times = T / N * np.arange(1, N + 1)
        responses = [np.kron(response, np.eye(n)) for response in compute_responses(settings)]
        self._motion_response = np.vstack(responses)  # (2 N n, N n)
        self._end_response = np.vstack([response[-n:] for response in responses])  # (2 n, N n)
        m_q, m_v = num_goal_rows
        self._slack_scale = np.concatenate([np.full(m_q, T**2), np.full(m_v, T)]) / np.sqrt(settings.goal_weight)

        self._plan = MathematicalProgram()
        self._vdot = self._plan.NewContinuousVariables(N * n, "vdot")
        terminal_slack = self._plan.NewContinuousVariables(m_q + m_v, "miss")
        self._plan.AddQuadraticCost(2.0 / N * np.eye(N * n), np.zeros(N * n), self._vdot, is_convex=True)
        m, nothing = m_q + m_v, np.zeros(m_q + m_v)
        self._plan.AddQuadraticCost(2.0 * np.eye(m), nothing, terminal_slack, is_convex=True)
        both = np.concatenate([self._vdot, terminal_slack])
        self._goal = self._plan.AddLinearEqualityConstraint(np.zeros((m, len(both))), nothing, both)
        unbounded = np.full(2 * N * n, np.inf)
        # The constraint contains only limits that have been added.
        self._motion = self._plan.AddLinearConstraint(self._motion_response, -unbounded, unbounded, self._vdot)
        torque = (np.eye(n), np.full(n, -np.inf), np.full(n, np.inf))
        self._torque = self._plan.AddLinearConstraint(*torque, self._vdot[:n])

        # The smallest violation of angle and rate limits minimises s_q / T^2 + s_v / T.
        self._rescue = MathematicalProgram()
        vdot = self._rescue.NewContinuousVariables(N * n, "vdot")
        self._violation = self._rescue.NewContinuousVariables(2, "overstep")
        self._rescue.AddLinearCost(np.array([1.0 / T**2, 1.0 / T]), self._violation)
        self._rescue.AddBoundingBoxConstraint(0.0, np.inf, self._violation)
        of_each = np.kron(np.eye(2), np.ones((N * n, 1)))
        variables = np.concatenate([vdot, self._violation])
        self._rescue_upper, self._rescue_lower = (
            self._rescue.AddLinearConstraint(
                np.hstack([self._motion_response, sign * of_each]), -unbounded, unbounded, variables
            )
            for sign in (-1.0, 1.0)
        )
        self._rescue_torque = self._rescue.AddLinearConstraint(*torque, vdot[:n])

        self._plan_solver, self._rescue_solver = DaqpSolver(), ClarabelSolver()
        self._options = SolverOptions()
        self._options.SetOption(DaqpSolver.id(), "primal_tol", _PLAN_TOLERANCE)
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            self._options.SetOption(ClarabelSolver.id(), name, _RESCUE_TOLERANCE)

    def solve(self, x: Array, goal: TerminalGoal, *, M: Array, bias: Array, guess: Array) -> Array | None:
        """Solves for the accelerations of the plan.

        Args:
            x: Present angles and rates, (2 num_joints,), [rad, rad/s].
            goal: Goal at the end of the horizon.
            M: Believed mass matrix, (num_joints, num_joints).
            bias: Torques at zero acceleration, (num_joints,), [N m].
            guess: Accelerations, (num_steps, num_joints), [rad/s^2]; limits that they violate are added first.

        Returns:
            Accelerations, (num_steps, num_joints), [rad/s^2], or None if the solver fails.
        """
        # Drake aborts the process if coefficients are not finite.
        if not all(np.isfinite(array).all() for array in (x, M, bias, guess, *goal)):
            return None
        q, v = x[: len(x) // 2], x[len(x) // 2 :]
        tau_max = self._limits.tau_max
        self._torque.evaluator().UpdateCoefficients(M, -tau_max - bias, tau_max - bias)
        self._set_goal(q, v, goal)
        lower, upper = self._compute_margins(q, v)
        vdot = self._solve_within(lower, upper, guess.ravel())
        if vdot is None:
            self._rescue_torque.evaluator().UpdateCoefficients(M, -tau_max - bias, tau_max - bias)
            violation = self._find_least_violation(lower, upper)
            if violation is not None:
                vdot = self._solve_within(lower - violation, upper + violation, guess.ravel())
        return None if vdot is None else vdot.reshape(guess.shape)

    def _solve_within(self, lower: Array, upper: Array, guess: Array) -> Array | None:
        """Solves within bounds on angles and rates, (2 N n,) each, and adds limits as they are violated."""
        entered = np.zeros(len(lower), dtype=bool)
        vdot: Array = guess
        while True:
            motion = self._motion_response @ vdot
            broken = (motion < lower - LIMIT_TOLERANCE) | (motion > upper + LIMIT_TOLERANCE)
            if vdot is not guess and not (broken & ~entered).any():
                return vdot
            entered |= broken
            rows = (self._motion_response[entered], lower[entered], upper[entered])
            self._motion.evaluator().UpdateCoefficients(*rows)
            result = self._plan_solver.Solve(self._plan, None, self._options)
            if not result.is_success():
                return None
            vdot = result.GetSolution(self._vdot)

    def _find_least_violation(self, lower: Array, upper: Array) -> Array | None:
        """Computes the smallest violation of angle and rate limits plus a margin for rounding errors, (2 N n,).

        The result is None if the solver fails.
        """
        self._rescue_upper.evaluator().UpdateUpperBound(upper)
        self._rescue_lower.evaluator().UpdateLowerBound(lower)
        result = self._rescue_solver.Solve(self._rescue, None, self._options)
        if not result.is_success():
            return None
        violation = np.maximum(0.0, result.GetSolution(self._violation)) + LIMIT_TOLERANCE
        return np.repeat(violation, len(lower) // 2)

    def _compute_margins(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Computes lower and upper limits minus the motion at constant joint rates, (2 N n,) each."""
        num_steps = len(self._times)
        coasting = np.concatenate([q + self._times[:, None] * v, np.tile(v, (num_steps, 1))])
        upper = np.repeat([self._limits.q_upper, self._limits.v_max], num_steps, axis=0)
        lower = np.repeat([self._limits.q_lower, -self._limits.v_max], num_steps, axis=0)
        return (lower - coasting).ravel(), (upper - coasting).ravel()

    def _set_goal(self, q: Array, v: Array, goal: TerminalGoal) -> None:
        end = np.vstack([goal.C_q @ self._end_response[: len(q)], goal.C_v @ self._end_response[len(q) :]])
        missing = np.concatenate([goal.d_q - goal.C_q @ (q + self._times[-1] * v), goal.d_v - goal.C_v @ v])
        self._goal.evaluator().UpdateCoefficients(np.hstack([end, np.diag(self._slack_scale)]), missing)
