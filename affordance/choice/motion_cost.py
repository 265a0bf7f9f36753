"""Computes the cost of a planned motion for thousands of inertias at once.

A motion with minimal joint accelerations does not depend on the inertia of the tool if no torque limit is active. Its
torques are linear in the inertial parameters (serial_chain.py). One kinematic roll-out and one matrix product
therefore give the torques for all inertias.
"""

import copy
import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.choice.demand import Demand, compute_grip_peaks
from affordance.control.cost_measure import CostMeasure
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.task import Task
from affordance.exceptions import NoPlanError
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel
from affordance.plant.chain_plant import build_chain
from affordance.settings import Settings

# Number of nodes of the midpoint rule along a motion; its error is below 0.1 % (tests/choice/test_reach.py).
NUM_NODES = 50
# Peak loads are searched at a subset of times. Between these times, torques deviate from straight lines by at most
# this fraction of their maxima. The error of peak loads is below 0.1 % (tests/choice/test_motion_cost.py).
_STRAIGHT = 0.01
# Number of samples whose torques are computed at a time. For 50 nodes and 7 joints, 6 MB of torques fit into caches.
_CHUNK = 2000
# A joint is at a limit if it is within this distance of an angle limit, [rad], or above this fraction of a rate
# limit.
_NEAR, _SHARE = 0.02, 0.98


class PlannedMotion(NamedTuple):
    """Motion over K control periods with constant joint acceleration in each."""

    control_period: float  # [s]
    q: Array  # joint angles at the beginning of each period, (K, num_joints), [rad]
    v: Array  # joint rates at the beginning of each period, (K, num_joints), [rad/s]
    vdot: Array  # joint accelerations over each period, (K, num_joints), [rad/s^2]


class Costs(NamedTuple):
    """Costs of a motion for each of S inertias."""

    # Absolute work of the joints, integral of sum_i |tau_i v_i| dt, (S,), [J] (paper, eq. 4). Negative work has the
    # same cost as positive work; no energy is recovered.
    work: Array
    effort: Array  # integral of |tau|^2 dt, (S,), [N^2 m^2 s]
    feasible: NDArray[np.bool_]  # True if the motion accomplishes the task within all torque limits, (S,)
    cost: Array  # cost by which options are compared, according to the settings, (S,); work by default

    @classmethod
    def of_nothing(cls, num_samples: int) -> "Costs":
        """Returns infinite costs, for an impossible motion."""
        nothing = np.full(num_samples, np.inf)
        return cls(nothing, nothing, np.zeros(num_samples, dtype=bool), nothing)


class Load(NamedTuple):
    """Costs and largest relative torque of a motion for S inertias, (S,) each, with units as in ``Costs``."""

    work: Array
    effort: Array
    cost: Array
    load: Array  # largest torque relative to the joint's limit


def plan_motion(model: ArmModel, task: Task, *, duration: float, settings: Settings) -> PlannedMotion:
    """Plans a motion from rest by simulating the controller with a double integrator, without torque limits.

    Raises:
        NoPlanError: The controller finds no plan.
    """
    unbounded = np.full_like(model.arm.limits.tau_max, np.inf)
    limits = model.arm.shrink_limits(settings.angle_margin, task.q_start)._replace(tau_max=unbounded)
    mpc = MinimumAccelerationMpc(limits, settings.mpc)
    control_period, horizon = settings.control_period, settings.mpc.horizon
    num_ticks = round(duration / control_period)
    q, v = task.q_start, np.zeros(model.arm.num_joints)
    rows = []
    for k in range(num_ticks):
        x = np.concatenate([q, v])
        solution = mpc.solve(x, task.compute_goal(model, x, k * control_period, horizon), model)
        if solution.status is MpcStatus.FAILED:
            raise NoPlanError(k * control_period)
        vdot = solution.vdot[0]
        rows.append((q, v, vdot))
        q, v = q + control_period * v + 0.5 * control_period**2 * vdot, v + control_period * vdot
    angles, rates, accelerations = (np.array(column) for column in zip(*rows, strict=True))
    return PlannedMotion(control_period, angles, rates, accelerations)


class MotionCost:
    """Costs of a planned motion as a function of the tool's inertial parameters."""

    def __init__(
        self,
        model: ArmModel,
        motion: PlannedMotion,
        num_nodes: int = NUM_NODES,
        infeasible_reason: str = "",
        measure: CostMeasure = CostMeasure.WORK,
    ) -> None:
        """Computes the torques along the motion as linear functions of the inertial parameters.

        Args:
            model: Model of the arm; its state and payload are changed.
            motion: Planned motion.
            num_nodes: Number of quadrature nodes, limited to one per control period.
            infeasible_reason: Reason if the motion cannot accomplish the task with any tool; otherwise empty.
            measure: Cost measure.
        """
        self._measure = measure
        self.motion = motion
        self.infeasible_reason = infeasible_reason
        num_ticks = len(motion.q)
        num_nodes = min(num_nodes, num_ticks)
        model.set_payload(np.zeros(NUM_PARAMETERS))
        self._chain = build_chain(model.arm)
        # Times are in control periods.
        nodes = _compute_states(motion, (np.arange(num_nodes) + 0.5) * num_ticks / num_nodes)
        torques = self._compute_torques(model, nodes)
        middles = _compute_states(motion, np.arange(num_ticks) + 0.5)
        at_middles = self._compute_torques(model, middles)
        turns = _find_turns(at_middles.reshape(num_ticks, -1))
        self._peak_nodes = tuple(each[turns] for each in middles)
        # Torques for quadrature, and torques relative to their limits for peaks. Both are linear in [pi, 1] and have
        # one row per node and joint.
        tau_max = model.arm.limits.tau_max
        self._torques = torques.reshape(-1, NUM_PARAMETERS + 1)
        self._loads = (at_middles[turns] / tau_max[:, None]).reshape(-1, NUM_PARAMETERS + 1)
        weight = motion.control_period * num_ticks / num_nodes
        self._signed_powers = weight * nodes[1].ravel()
        self._powers = np.abs(self._signed_powers)
        # The integral of |tau|^2 is a quadratic form in [pi, 1].
        self._effort = weight * self._torques.T @ self._torques

    def _compute_torques(self, model: ArmModel, states: tuple[Array, Array, Array]) -> Array:
        """Computes the coefficients of the torques, [N m], at N states, linear in [pi, 1], (N, num_joints, 11)."""
        q, v, vdot = states
        tau_arm = np.empty_like(v)
        for node in range(len(q)):
            model.set_state(np.concatenate([q[node], v[node]]))
            tau_arm[node] = model.compute_inverse_dynamics(vdot[node])
        return np.concatenate([self._chain.compute_payload_regressors(q, v, vdot), tau_arm[..., None]], axis=2)

    @property
    def q_start(self) -> Array:
        """Joint angles at the start, (num_joints,), [rad]."""
        q_start: Array = self.motion.q[0]
        return q_start

    def measured_by(self, measure: CostMeasure) -> "MotionCost":
        """Returns a copy with another cost measure."""
        other = copy.copy(self)
        other._measure = measure
        return other

    def compute(self, pi: Array) -> Costs:
        """Computes the costs for S tools with parameters pi about To in T, (S, 10)."""
        work, effort, cost, load = self.compute_load(pi)
        return Costs(work, effort, (load <= 1.0) & (not self.infeasible_reason), cost)

    def compute_load(self, pi: Array) -> Load:
        """Computes the costs and the largest relative torque for parameters pi, (S, 10)."""
        known = np.column_stack([pi, np.ones(len(pi))])
        effort = ((known @ self._effort) * known).sum(axis=1)
        work, load = np.empty((2, len(pi)))
        balance = np.zeros(len(pi))  # positive minus negative work
        share = self._measure.negative_weight
        for start in range(0, len(pi), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            torques = self._torques @ known[chunk].T
            if share != 1.0:
                balance[chunk] = self._signed_powers @ torques
            work[chunk] = self._powers @ np.abs(torques, out=torques)
            loads = self._loads @ known[chunk].T
            load[chunk] = np.abs(loads, out=loads).max(axis=0)
        cost = effort if self._measure is CostMeasure.EFFORT else work
        if share != 1.0:
            cost = 0.5 * ((1.0 + share) * work + (1.0 - share) * balance)
        return Load(work, effort, cost, load)

    def compute_joint_loads(self, pi: Array) -> Array:
        """Computes the largest relative torque of each joint, (num_joints, S), for parameters pi, (S, 10)."""
        known = np.column_stack([pi, np.ones(len(pi))])
        num_joints = self.motion.q.shape[1]
        greatest = np.empty((num_joints, len(pi)))
        for start in range(0, len(pi), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            loads = self._loads @ known[chunk].T
            np.abs(loads, out=loads)
            loads.reshape(-1, num_joints, loads.shape[1]).max(axis=0, out=greatest[:, chunk])
        return greatest

    def compute_demand(self, pi: Array) -> Demand:
        """Computes the peak loads on joints and grip for parameters pi, (S, 10)."""
        return Demand(self.compute_joint_loads(pi), *compute_grip_peaks(self._wrench_regressors, pi))

    @functools.cached_property
    def _wrench_regressors(self) -> Array:
        return self._chain.compute_wrench_regressors(*self._peak_nodes)


def _compute_states(motion: PlannedMotion, moments: NDArray[np.floating]) -> tuple[Array, Array, Array]:
    """Computes angles, rates and accelerations, (N, num_joints) each, at times in units of control periods, (N,)."""
    ticks = moments.astype(int)
    since = motion.control_period * (moments - ticks)[:, None]
    vdot = motion.vdot[ticks]
    v = motion.v[ticks] + since * vdot
    return motion.q[ticks] + 0.5 * since * (motion.v[ticks] + v), v, vdot


def _find_turns(curve: Array) -> NDArray[np.intp]:
    """Finds the rows of a curve, (K, M), that approximate it by straight lines (Douglas and Peucker 1973).

    Deviations are at most the fraction ``_STRAIGHT`` of each column's largest absolute value.
    """
    curve = curve / np.maximum(np.abs(curve).max(axis=0), np.finfo(float).tiny)
    kept, spans = {0, len(curve) - 1}, [(0, len(curve) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        share = np.arange(1, last - first)[:, None] / (last - first)
        line = curve[first] + share * (curve[last] - curve[first])
        gaps = np.abs(curve[first + 1 : last] - line).max(axis=1)
        farthest = int(np.argmax(gaps))
        if gaps[farthest] > _STRAIGHT:
            turn = first + 1 + farthest
            kept.add(turn)
            spans += [(first, turn), (turn, last)]
    return np.array(sorted(kept))


def describe_limit(arm: Arm, motion: PlannedMotion, row: int) -> str:
    """Describes which joint is at a limit in a row of a motion."""
    q, v, limits = motion.q[row], motion.v[row], arm.limits
    gaps = np.minimum(q - limits.q_lower, limits.q_upper - q)
    joint = int(np.argmin(gaps))
    if gaps[joint] <= _NEAR:
        lower, upper = limits.q_lower[joint], limits.q_upper[joint]
        limit = lower if q[joint] - lower < upper - q[joint] else upper
        return f"where {arm.joint_names[joint]} is at its limit of {limit:.3g} rad"
    shares = np.abs(v) / limits.v_max
    joint = int(np.argmax(shares))
    if shares[joint] >= _SHARE:
        return f"where {arm.joint_names[joint]} is at its limit of {limits.v_max[joint]:.3g} rad/s"
    return f"where no joint is at a limit of angle or rate: the place may be out of reach of its {len(q)} joints"


def measure_cost(tau: Array, v: Array, control_period: float) -> tuple[float, float]:
    """Computes absolute work, [J], and the integral of |tau|^2 dt, [N^2 m^2 s], from a log.

    The log has one row per control period. Velocities are assumed to be linear in time within a period.

    Args:
        tau: Constant torques of the period before each row, (N, num_joints), [N m]; the first row is ignored.
        v: Joint velocities, (N, num_joints), [rad/s].
        control_period: Control period, [s].
    """
    rates = np.abs(v)
    mean_rates = 0.5 * (rates[1:] + rates[:-1])
    return float(control_period * np.sum(np.abs(tau[1:]) * mean_rates)), float(control_period * np.sum(tau[1:] ** 2))
