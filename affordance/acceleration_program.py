"""The bounded quadratic program behind minimum angular acceleration; see mpc.py for the problem it states.

Angles and rates after each step are decision variables beside the accelerations, so that every constraint is sparse
and only three of them change from tick to tick: the first step's dynamics, the goal, and the torque limit.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions
from pydrake.symbolic import Variable

from affordance.arm import JointLimits

Array = NDArray[np.float64]

# Two orders tighter than Clarabel's own 1e-8, so that plans agree with the closed form to 1e-8 (tests/test_mpc.py).
_SOLVER_TOLERANCE = 1e-12


class MpcSettings(NamedTuple):
    """What the controller is free to choose; the same for all tasks.

    Attributes:
        horizon: T, [s].
        num_steps: N.
        goal_weight: Weight of missing the goal against acceleration, dimensionless.
        limit_weight: Weight of overstepping a limit of angle or rate, [rad/s^2].
    """

    horizon: float
    num_steps: int
    goal_weight: float = 1e6
    limit_weight: float = 1e6


class TerminalGoal(NamedTuple):
    """Linear goal at the end of the horizon: C_q q_N = d_q and C_v v_N = d_v.

    Attributes:
        C_q: Shape (m_q, num_joints).
        d_q: Shape (m_q,).
        C_v: Shape (m_v, num_joints).
        d_v: Shape (m_v,).
    """

    C_q: Array
    d_q: Array
    C_v: Array
    d_v: Array


class AccelerationProgram:
    """A kept MathematicalProgram for goals with a given number of rows."""

    def __init__(self, limits: JointLimits, settings: MpcSettings, num_goal_rows: tuple[int, int]) -> None:
        """Builds the program for goals of (m_q, m_v) rows."""
        N, T = settings.num_steps, settings.horizon
        n, h = len(limits.tau_max), settings.horizon / settings.num_steps
        self._horizon = T
        self._limits = limits
        self._step = h
        self._num_goal_rows = num_goal_rows
        program = MathematicalProgram()
        vdot = program.NewContinuousVariables(N, n, "vdot")
        v = program.NewContinuousVariables(N, n, "v")
        q = program.NewContinuousVariables(N, n, "q")
        miss = program.NewContinuousVariables(sum(num_goal_rows), "miss")
        slack = program.NewContinuousVariables(2, "slack")
        program.AddQuadraticCost(2.0 / N * np.eye(N * n), np.zeros(N * n), vdot.ravel(), is_convex=True)
        program.AddQuadraticCost(2.0 * np.eye(len(miss)), np.zeros(len(miss)), miss, is_convex=True)
        program.AddLinearCost(settings.limit_weight * np.array([1.0 / T**2, 1.0 / T]), slack)
        program.AddBoundingBoxConstraint(0.0, np.inf, slack)

        one, zero = np.eye(n), np.zeros((n, n))
        first = np.block([[one, zero, -0.5 * h**2 * one], [zero, one, -h * one]])
        self._first_step = program.AddLinearEqualityConstraint(
            first, np.zeros(2 * n), np.concatenate([q[0], v[0], vdot[0]])
        )
        step = np.block([[one, zero, -0.5 * h**2 * one, -one, -h * one], [zero, one, -h * one, zero, -one]])
        for k in range(1, N):
            program.AddLinearEqualityConstraint(
                step, np.zeros(2 * n), np.concatenate([q[k], v[k], vdot[k], q[k - 1], v[k - 1]])
            )
        self._miss_scale = np.concatenate([np.full(num_goal_rows[0], T**2), np.full(num_goal_rows[1], T)]) / np.sqrt(
            settings.goal_weight
        )
        self._goal = program.AddLinearEqualityConstraint(
            np.zeros((len(miss), 2 * n + len(miss))),
            np.zeros(len(miss)),
            np.concatenate([q[-1], v[-1], miss]),
        )
        for values, slack_variable, lower, upper in (
            (q, slack[0], limits.q_lower, limits.q_upper),
            (v, slack[1], -limits.v_max, limits.v_max),
        ):
            _add_soft_bounds(program, values, slack_variable, lower, upper)
        self._torque = program.AddLinearConstraint(np.eye(n), np.full(n, -np.inf), np.full(n, np.inf), vdot[0])
        self._vdot = vdot
        self._program = program
        self._solver = ClarabelSolver()
        self._options = SolverOptions()
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            self._options.SetOption(ClarabelSolver.id(), name, _SOLVER_TOLERANCE)

    def solve(self, x: Array, goal: TerminalGoal, M: Array, bias: Array) -> Array | None:
        """Solves for the accelerations.

        Args:
            x: Joint angles and rates, shape (2 num_joints,), [rad, rad/s].
            goal: The goal at the end of the horizon.
            M: Believed mass matrix, shape (num_joints, num_joints).
            bias: Believed torques at zero acceleration, shape (num_joints,), [N m].

        Returns: vdot, shape (num_steps, num_joints), [rad/s^2]; None if the solver failed.
        """
        # Drake aborts the process on coefficients that are not finite.
        if not all(np.isfinite(array).all() for array in (x, M, bias, *goal)):
            return None
        n = len(bias)
        q, v = x[:n], x[n:]
        first_step = self._first_step.evaluator()
        first_step.UpdateCoefficients(first_step.GetDenseA(), np.concatenate([q + self._step * v, v]))
        m_q, m_v = self._num_goal_rows
        C = np.block([[goal.C_q, np.zeros((m_q, n))], [np.zeros((m_v, n)), goal.C_v]])
        self._goal.evaluator().UpdateCoefficients(
            np.hstack([C, np.diag(self._miss_scale)]), np.concatenate([goal.d_q, goal.d_v])
        )
        tau_max = self._limits.tau_max
        self._torque.evaluator().UpdateCoefficients(M, -tau_max - bias, tau_max - bias)
        result = self._solver.Solve(self._program, None, self._options)
        return result.GetSolution(self._vdot) if result.is_success() else None


def _add_soft_bounds(
    program: MathematicalProgram, values: NDArray[np.object_], slack: Variable, lower: Array, upper: Array
) -> None:
    """Adds lower - slack <= values <= upper + slack for every step, where the bounds are finite."""
    num_steps = len(values)
    for bound, sign in ((upper, 1.0), (-lower, -1.0)):
        A = np.hstack([sign * np.eye(num_steps), -np.ones((num_steps, 1))])
        for j in np.flatnonzero(np.isfinite(bound)):
            program.AddLinearConstraint(
                A, np.full(num_steps, -np.inf), np.full(num_steps, bound[j]), np.array([*values[:, j], slack])
            )
