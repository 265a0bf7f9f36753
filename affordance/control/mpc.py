"""Model predictive control with minimum joint acceleration (paper, III).

Over a horizon of duration T, with N steps of constant joint acceleration, the planner minimises

    1/N sum_k |vdot_k|^2  +  goal_weight |e|^2

subject to double-integrator dynamics and

    q_lower - s_q <= q_k <= q_upper + s_q,   |v_k| <= v_max + s_v,   k = 1..N
    |tau_0| <= tau_max                                                         (torque in the first control period)

The error e = [(C_q q_N - d_q) / T^2, (C_v v_N - d_v) / T] is the deviation from the goal at the end of the horizon.
The slack s is zero if the limits can be satisfied, and otherwise as small as possible. Torque limits have priority
over angle and rate limits, limits over the goal, and the goal over the cost. The goal is soft, so that a plan always
exists; the remaining error is about 1 / goal_weight of the distance to the goal. A plan without active limits is the
solution of a linear system. If it violates no limit, it is the optimum.
"""

import enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.control.constrained_qp import LIMIT_TOLERANCE, AccelerationProgram
from affordance.control.problem import MpcSettings, TerminalGoal, compute_responses
from affordance.plant.arm import JointLimits
from affordance.plant.arm_model import ArmModel


class MpcStatus(enum.Enum):
    """Status of a plan."""

    FREE = 0  # no limit is active; the plan is computed in closed form unless ``always_program``
    LIMITED = 1  # a limit is active; the plan is computed by the quadratic program
    FAILED = 2  # the solver failed; the previous plan continues


class MpcSolution(NamedTuple):
    """Plan of the controller."""

    vdot: Array  # joint accelerations, shape (num_steps, num_joints), [rad/s^2]
    # Torques for the believed inertia, shape (num_joints,), [N m]. They are constant over the first control period.
    # If a limit is active, they are the torques at its start, which the program constrains.
    tau: Array
    status: MpcStatus


class MinimumAccelerationMpc:
    """Planner that minimises joint acceleration.

    Results do not depend on earlier calls, because cached quantities depend only on the matrices of the goal.
    """

    def __init__(self, limits: JointLimits, settings: MpcSettings) -> None:
        """Computes the matrices of the closed-form solution."""
        self.settings = settings
        self.limits = limits
        T, N = settings.horizon, settings.num_steps
        h = T / N
        steps = np.arange(1, N + 1)
        angle_response, rate_response = compute_responses(settings)
        # The optimal accelerations are vdot = terminal^T y, a linear combination of the last rows of both responses.
        terminal = np.array([angle_response[-1] / T**2, rate_response[-1] / T])  # (2, N)
        self._gram = terminal @ terminal.T
        # [vdot; q; v] over all steps = trajectory_map @ [q_0; v_0; y_q; y_v], with one column per joint.
        self._trajectory_map = np.block(
            [
                [np.zeros((N, 2)), terminal.T],
                [np.ones((N, 1)), h * steps[:, None], angle_response @ terminal.T],
                [np.zeros((N, 1)), np.ones((N, 1)), rate_response @ terminal.T],
            ]
        )
        self._motion_response = np.vstack([angle_response, rate_response])
        self._coasting = self._trajectory_map[N:, :2]
        lower = np.repeat([limits.q_lower, -limits.v_max], N, axis=0)
        upper = np.repeat([limits.q_upper, limits.v_max], N, axis=0)
        self._motion_lower, self._motion_upper = lower - LIMIT_TOLERANCE, upper + LIMIT_TOLERANCE
        self._within_lower, self._within_upper = lower + LIMIT_TOLERANCE, upper - LIMIT_TOLERANCE
        self._kept_matrices: tuple[Array | None, Array | None] = (None, None)
        self._programs: dict[tuple[int, int], AccelerationProgram] = {}

    def solve(self, x: Array, goal: TerminalGoal, model: ArmModel) -> MpcSolution:
        """Plans a motion to a goal. Accelerations and torques are NaN if the solver fails.

        Args:
            x: Present angles and rates, (2 num_joints,), [rad, rad/s].
            goal: Goal at the end of the horizon.
            model: Model of the arm with the believed payload; its state is changed.
        """
        if self.settings.always_program:
            return self._solve_by_program(x, goal, model)
        trajectory = self.solve_free(x, goal)
        N = self.settings.num_steps
        motion = trajectory[N:]
        if _is_all((motion >= self._motion_lower) & (motion <= self._motion_upper)):
            tau = model.compute_held_torque(x, trajectory[0])
            if _is_all(np.abs(tau) <= self.limits.tau_max):
                return MpcSolution(trajectory[:N], tau, MpcStatus.FREE)
        return self.solve_limited(x, goal, model)

    def solve_free(self, x: Array, goal: TerminalGoal) -> Array:
        """Plans without limits by one matrix product. The matrix is cached while C_q and C_v are the same arrays.

        Returns:
            Accelerations, angles and rates over the steps, (3 num_steps, num_joints).
        """
        if goal.C_q is not self._kept_matrices[0] or goal.C_v is not self._kept_matrices[1]:
            self._trajectory_gain = self._compute_trajectory_gain(goal)
            # Writeable arrays may change in place, so they cannot be keys of the cache.
            can_change = goal.C_q.flags.writeable or goal.C_v.flags.writeable
            self._kept_matrices = (None, None) if can_change else (goal.C_q, goal.C_v)
        # At every control step: the method dot has half the overhead of the operator @.
        trajectory: Array = self._trajectory_gain.dot(np.concatenate([x, goal.d_q, goal.d_v]))
        return trajectory.reshape(3 * self.settings.num_steps, -1)

    def solve_limited(self, x: Array, goal: TerminalGoal, model: ArmModel) -> MpcSolution:
        """Plans within the limits with a convex quadratic program, starting with limits that the free plan violates.

        Arguments and result are the same as for ``solve``.
        """
        return self._run_program(x, goal, model, guess=self.solve_free(x, goal)[: self.settings.num_steps])

    def _solve_by_program(self, x: Array, goal: TerminalGoal, model: ArmModel) -> MpcSolution:
        """Plans with the quadratic program, starting with limits that motion at constant rates violates."""
        n = len(x) // 2
        solution = self._run_program(x, goal, model, guess=np.zeros((self.settings.num_steps, n)))
        if solution.status is MpcStatus.FAILED:
            return solution
        motion = self._coasting @ x.reshape(2, n) + self._motion_response @ solution.vdot
        within = ((motion > self._within_lower) & (motion < self._within_upper)).all()
        within &= (np.abs(solution.tau) < self.limits.tau_max - LIMIT_TOLERANCE).all()
        tau = model.compute_held_torque(x, solution.vdot[0])
        within &= (np.abs(tau) <= self.limits.tau_max).all()
        return MpcSolution(solution.vdot, tau, MpcStatus.FREE) if within else solution

    def _run_program(self, x: Array, goal: TerminalGoal, model: ArmModel, *, guess: Array) -> MpcSolution:
        num_goal_rows = (len(goal.d_q), len(goal.d_v))
        if num_goal_rows not in self._programs:
            self._programs[num_goal_rows] = AccelerationProgram(self.limits, self.settings, num_goal_rows)
        n, vdot = len(x) // 2, None
        if _is_all(np.isfinite(x)):  # otherwise Drake aborts the process
            model.set_state(x)
            M, bias = model.compute_mass_matrix(), model.compute_inverse_dynamics(np.zeros(n))
            vdot = self._programs[num_goal_rows].solve(x, goal, M=M, bias=bias, guess=guess)
        if vdot is None:
            nothing = np.full((self.settings.num_steps, n), np.nan)
            return MpcSolution(nothing, nothing[0], MpcStatus.FAILED)
        return MpcSolution(vdot, M @ vdot[0] + bias, MpcStatus.LIMITED)

    def continue_plan(self, vdot: Array, elapsed: float) -> Array:
        """Returns the present accelerations of an earlier plan, (num_joints,), [rad/s^2]; zero after its end.

        Args:
            vdot: Accelerations of the plan, (num_steps, num_joints), [rad/s^2].
            elapsed: Time since the start of the plan, [s].
        """
        # The constant compensates rounding errors, because steps and control periods start at the same times.
        step = int(elapsed / self.settings.horizon * self.settings.num_steps + 1e-6)
        return vdot[step] if step < len(vdot) else np.zeros(vdot.shape[1])

    def _compute_trajectory_gain(self, goal: TerminalGoal) -> Array:
        """Computes the gain from [x, d_q, d_v] to the trajectory of n joints, (3 num_steps n, 2 n + m_q + m_v).

        Let S = C terminal and r = d - C [q + T v, v], the error at constant rates, both in the units of e. The
        optimum of 1/N |vdot|^2 + w |r - S vdot|^2 is vdot = S^T (S S^T + I / (N w))^-1 r.
        """
        T = self.settings.horizon
        m_q, n = goal.C_q.shape
        m = m_q + len(goal.d_v)
        C = np.zeros((m, 2 * n))
        C[:m_q, :n], C[m_q:, n:] = goal.C_q, goal.C_v
        # S S^T is the product of two Gram matrices: of the rows of C over the joints, and of the rows of terminal.
        rows = np.vstack([goal.C_q, goal.C_v])
        kinds = np.repeat([0, 1], [m_q, m - m_q])
        gram = (rows @ rows.T) * self._gram[np.ix_(kinds, kinds)]
        gram[np.diag_indices(m)] += 1.0 / (self.settings.num_steps * self.settings.goal_weight)
        units_of_e = np.array([1.0 / T**2, 1.0 / T])[kinds]
        gain = C.T @ (np.linalg.inv(gram) * units_of_e)
        coasted = C.copy()  # C [q + T v, v]
        coasted[:m_q, n:] = T * goal.C_q
        gain = np.hstack([-gain @ coasted, gain])  # from [x, d_q, d_v] to y
        joints = np.arange(n)
        by_joint = np.tensordot(self._trajectory_map[:, 2:], gain.reshape(2, n, -1), 1)
        by_joint[:, joints, joints] += self._trajectory_map[:, :1]
        by_joint[:, joints, n + joints] += self._trajectory_map[:, 1:2]
        return by_joint.reshape(-1, gain.shape[1])


def _is_all(flags: NDArray[np.bool_]) -> bool:
    """Returns True if all flags are true, three times as fast as ``flags.all()``."""
    return bool(np.count_nonzero(flags) == flags.size)
