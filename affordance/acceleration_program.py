"""The bounded quadratic program behind minimum angular acceleration; see mpc.py for the problem it states.

The accelerations are the decision variables; angles and rates after each step are linear in them. Of the limits of
angle and rate, which are many and of which few are ever reached, only those enter that a plan without them breaks.
What enters is found by solving, looking, and solving again; a solution that breaks none of the others is the optimum
of the whole program.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions

from affordance.arm import JointLimits

Array = NDArray[np.float64]

# Four orders tighter than Clarabel's own 1e-8, so that plans agree with the closed form to 1e-8 (tests/test_mpc.py).
_SOLVER_TOLERANCE = 1e-12
# How far a plan may overstep a limit before the limit enters: rounding, in rad and rad/s.
LIMIT_TOLERANCE = 1e-9


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


def compute_responses(settings: MpcSettings) -> tuple[Array, Array]:
    """Angles and rates after each step (rows) per unit acceleration in each step (columns), (N, N) each."""
    N = settings.num_steps
    h = settings.horizon / N
    steps = np.arange(1, N + 1)
    return h**2 * np.tri(N) * (steps[:, None] - steps + 0.5), h * np.tri(N)


class AccelerationProgram:
    """A kept MathematicalProgram for goals with a given number of rows."""

    def __init__(self, limits: JointLimits, settings: MpcSettings, num_goal_rows: tuple[int, int]) -> None:
        """Builds the program for goals of (m_q, m_v) rows."""
        N, T, n = settings.num_steps, settings.horizon, len(limits.tau_max)
        self._limits = limits
        self._times = T / N * np.arange(1, N + 1)
        responses = [np.kron(response, np.eye(n)) for response in compute_responses(settings)]
        self._motion_response = np.vstack(responses)  # (2 N n, N n)
        self._end_response = np.vstack([response[-n:] for response in responses])  # (2 n, N n)
        m_q, m_v = num_goal_rows
        self._miss_scale = np.concatenate([np.full(m_q, T**2), np.full(m_v, T)]) / np.sqrt(settings.goal_weight)

        program = MathematicalProgram()
        vdot = program.NewContinuousVariables(N * n, "vdot")
        miss = program.NewContinuousVariables(m_q + m_v, "miss")
        slack = program.NewContinuousVariables(2, "slack")
        program.AddQuadraticCost(2.0 / N * np.eye(N * n), np.zeros(N * n), vdot, is_convex=True)
        program.AddQuadraticCost(2.0 * np.eye(len(miss)), np.zeros(len(miss)), miss, is_convex=True)
        program.AddLinearCost(settings.limit_weight * np.array([1.0 / T**2, 1.0 / T]), slack)
        program.AddBoundingBoxConstraint(0.0, np.inf, slack)
        self._goal = program.AddLinearEqualityConstraint(
            np.zeros((len(miss), N * n + len(miss))), np.zeros(len(miss)), np.concatenate([vdot, miss])
        )
        # First the upper limits of angles and rates, then the lower ones, each less its slack.
        off = np.kron(np.eye(2), -np.ones((N * n, 1)))
        endless = np.full(2 * N * n, np.inf)
        self._bounds = [
            program.AddLinearConstraint(
                np.hstack([sign * self._motion_response, off]), -endless, endless, np.concatenate([vdot, slack])
            )
            for sign in (1.0, -1.0)
        ]
        self._torque = program.AddLinearConstraint(np.eye(n), np.full(n, -np.inf), np.full(n, np.inf), vdot[:n])
        self._program, self._vdot, self._slack = program, vdot, slack
        self._solver = ClarabelSolver()
        self._options = SolverOptions()
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            self._options.SetOption(ClarabelSolver.id(), name, _SOLVER_TOLERANCE)

    def solve(self, x: Array, goal: TerminalGoal, M: Array, bias: Array, free: Array) -> Array | None:
        """Solves for the accelerations.

        Args:
            x: Joint angles and rates, shape (2 num_joints,), [rad, rad/s].
            goal: The goal at the end of the horizon.
            M: Believed mass matrix, shape (num_joints, num_joints).
            bias: Believed torques at zero acceleration, shape (num_joints,), [N m].
            free: Accelerations of the plan without limits, shape (num_steps, num_joints), [rad/s^2].

        Returns: vdot, shape (num_steps, num_joints), [rad/s^2]; None if the solver failed.
        """
        # Drake aborts the process on coefficients that are not finite.
        if not all(np.isfinite(array).all() for array in (x, M, bias, free, *goal)):
            return None
        q, v = np.split(x, 2)
        self._set_goal(q, v, goal)
        tau_max = self._limits.tau_max
        self._torque.evaluator().UpdateCoefficients(M, -tau_max - bias, tau_max - bias)
        rooms = self._compute_rooms(q, v)
        entered = self._find_broken(free.ravel(), np.zeros(2), rooms)
        while True:
            for bound, room, rows in zip(self._bounds, rooms, entered, strict=True):
                bound.evaluator().UpdateUpperBound(np.where(rows, room, np.inf))
            result = self._solver.Solve(self._program, None, self._options)
            if not result.is_success():
                return None
            vdot = result.GetSolution(self._vdot)
            broken = self._find_broken(vdot, result.GetSolution(self._slack), rooms) & ~entered
            if not broken.any():
                return vdot.reshape(free.shape)
            entered |= broken

    def _compute_rooms(self, q: Array, v: Array) -> Array:
        """How far angles and rates may go up and down from where they coast to, (2, 2 N n)."""
        num_steps = len(self._times)
        coasting = np.concatenate([q + self._times[:, None] * v, np.tile(v, (num_steps, 1))])
        upper = np.repeat([self._limits.q_upper, self._limits.v_max], num_steps, axis=0)
        lower = np.repeat([self._limits.q_lower, -self._limits.v_max], num_steps, axis=0)
        return np.array([(upper - coasting).ravel(), (coasting - lower).ravel()])

    def _find_broken(self, vdot: Array, slack: Array, rooms: Array) -> NDArray[np.bool_]:
        """Which limits a plan oversteps by more than its slack, (2, 2 N n)."""
        motion = self._motion_response @ vdot
        broken: NDArray[np.bool_] = (
            np.array([motion, -motion]) > rooms + np.repeat(slack, len(vdot)) + LIMIT_TOLERANCE
        )
        return broken

    def _set_goal(self, q: Array, v: Array, goal: TerminalGoal) -> None:
        end = np.vstack([goal.C_q @ self._end_response[: len(q)], goal.C_v @ self._end_response[len(q) :]])
        missing = np.concatenate([goal.d_q - goal.C_q @ (q + self._times[-1] * v), goal.d_v - goal.C_v @ v])
        self._goal.evaluator().UpdateCoefficients(np.hstack([end, np.diag(self._miss_scale)]), missing)
