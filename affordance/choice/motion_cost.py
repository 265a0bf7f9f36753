"""What a planned motion costs, for ten thousand believed inertias at once.

A plan of least angular acceleration is made of joint accelerations: while no torque limit is active it is the same
whatever the tool is believed to weigh, and only its torques differ, linearly in the tool's inertial parameters
(payload_regressor.py). So one kinematic roll-out serves all of them, and their works are one matrix product.
"""

import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.control.cost_measure import CostMeasure
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.task import Task
from affordance.exceptions import NoPlanError
from affordance.objects.inertia import NUM_PARAMETERS
from affordance.plant.arm_model import ArmModel
from affordance.plant.payload_regressor import compute_payload_regressors
from affordance.plant.serial_chain import build_chain
from affordance.settings import Settings

# Nodes of the quadrature along a motion: the midpoint rule then errs by less than 0.1 % (tests/choice/test_reach.py).
NUM_NODES = 50
# Samples whose torques are held in memory at a time: 50 nodes of 7 joints then take 6 MB, which caches hold.
_CHUNK = 2000


class PlannedMotion(NamedTuple):
    """A motion of K ticks, each of constant joint acceleration.

    Attributes:
        control_period: Duration of each, [s].
        q: Joint angles at the beginning of each, (K, num_joints), [rad].
        v: Joint rates at the beginning of each, (K, num_joints), [rad/s].
        vdot: Joint accelerations, (K, num_joints), [rad/s^2].
    """

    control_period: float
    q: Array
    v: Array
    vdot: Array


class Costs(NamedTuple):
    """What a motion costs under each of S inertias.

    Attributes:
        work: Absolute work of the joints, integral of sum_i |tau_i v_i| dt, (S,), [J] (paper, eq. 4): braking counts
            as driving does, and nothing is recovered.
        effort: Integral of |tau|^2 dt, (S,), [N^2 m^2 s].
        feasible: Whether the motion does what is asked and every torque keeps its limit, (S,).
        cost: What the measure of the settings says, by which options are compared, (S,); the work by default.
    """

    work: Array
    effort: Array
    feasible: NDArray[np.bool_]
    cost: Array


class Load(NamedTuple):
    """Costs of a motion under each of S inertias, and how near it comes to a torque limit; (S,) each, as in Costs."""

    work: Array
    effort: Array
    cost: Array
    load: Array  # largest part of a joint's torque limit


def plan_motion(model: ArmModel, task: Task, *, duration: float, settings: Settings) -> PlannedMotion:
    """Rolls the controller out, from rest where the task starts, on the double integrator it plans with.

    Args:
        model: The arm; its state is set.
        task: What is to be done.
        duration: For how long, [s].
        settings: Those of the controller; torque limits are left aside.

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
        model.set_state(x)
        solution = mpc.solve(x, task.compute_goal(model, x, k * control_period, horizon), model)
        if solution.status is MpcStatus.FAILED:
            raise NoPlanError(k * control_period)
        vdot = solution.vdot[0]
        rows.append((q, v, vdot))
        q, v = q + control_period * v + 0.5 * control_period**2 * vdot, v + control_period * vdot
    angles, rates, accelerations = (np.array(column) for column in zip(*rows, strict=True))
    return PlannedMotion(control_period, angles, rates, accelerations)


class MotionCost:
    """The costs of a planned motion as a function of the tool's inertial parameters.

    Attributes:
        motion: The motion.
        infeasible_reason: Why the motion does not do what is asked, whatever the tool weighs; empty if it does.
    """

    def __init__(
        self,
        model: ArmModel,
        motion: PlannedMotion,
        num_nodes: int = NUM_NODES,
        infeasible_reason: str = "",
        measure: CostMeasure = CostMeasure.WORK,
    ) -> None:
        """Computes torques of the arm and regressors at the nodes.

        Args:
            model: The arm; its state and payload are set.
            motion: The motion.
            num_nodes: Nodes of the midpoint rule, at most one a tick.
            infeasible_reason: Why the motion does not do what is asked; it is then feasible with no tool.
            measure: By what motions are compared.
        """
        self._measure = measure
        self.motion = motion
        self.infeasible_reason = infeasible_reason
        num_ticks = len(motion.q)
        num_nodes = min(num_nodes, num_ticks)
        # In ticks. One more, in the middle of the last tick, counts for the limits alone: a swing loads its joints
        # most at its end.
        moments = np.append((np.arange(num_nodes) + 0.5) * num_ticks / num_nodes, num_ticks - 0.5)
        ticks = moments.astype(int)
        since = motion.control_period * (moments - ticks)[:, None]
        vdot = motion.vdot[ticks]
        v = motion.v[ticks] + since * vdot
        q = motion.q[ticks] + 0.5 * since * (motion.v[ticks] + v)
        self._weight = motion.control_period * num_ticks / num_nodes
        model.set_payload(np.zeros(NUM_PARAMETERS))
        tau_arm = np.empty_like(v)
        for node in range(len(moments)):
            model.set_state(np.concatenate([q[node], v[node]]))
            tau_arm[node] = model.compute_inverse_dynamics(vdot[node])
        Y = compute_payload_regressors(build_chain(model.arm), q, v, vdot)
        # Constant and linear part of all torques, nodes times joints stacked.
        self._tau_arm = tau_arm.reshape(-1, 1)
        self._Y = Y.reshape(-1, NUM_PARAMETERS)
        self._signed_rates = v[:num_nodes].reshape(-1)
        self._rates = np.abs(self._signed_rates)
        self._per_tau_max = np.tile(1.0 / model.arm.limits.tau_max, len(moments))[:, None]

    def measured_by(self, measure: CostMeasure) -> "MotionCost":
        """The same motion, compared by another measure."""
        other = copy.copy(self)
        other._measure = measure
        return other

    def compute(self, pi: Array) -> Costs:
        """Computes the costs for S tools of inertial parameters pi about To, expressed in T, shape (S, 10)."""
        work, effort, cost, load = self.compute_load(pi)
        return Costs(work, effort, (load <= 1.0) & (not self.infeasible_reason), cost)

    def compute_load(self, pi: Array) -> Load:
        """Computes the costs, and the largest part of a torque limit; argument as of ``compute``."""
        work, effort, load = np.empty((3, len(pi)))
        balance = np.zeros(len(pi))  # positive less negative work
        share = self._measure.negative_weight
        for start in range(0, len(pi), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            tau = self._tau_arm + self._Y @ pi[chunk].T
            counted = tau[: len(self._rates)]
            effort[chunk] = self._weight * np.einsum("ks,ks->s", counted, counted)
            if share != 1.0:
                balance[chunk] = self._weight * (self._signed_rates @ counted)
            np.abs(tau, out=tau)
            work[chunk] = self._weight * (self._rates @ counted)
            tau *= self._per_tau_max
            load[chunk] = tau.max(axis=0)
        cost = effort if self._measure is CostMeasure.EFFORT else work
        if share != 1.0:
            cost = 0.5 * ((1.0 + share) * work + (1.0 - share) * balance)
        return Load(work, effort, cost, load)

    def compute_joint_loads(self, pi: Array) -> Array:
        """Computes the largest part of each joint's torque limit, (num_joints, S); argument as of ``compute``."""
        parts = np.abs(self._tau_arm + self._Y @ pi.T) * self._per_tau_max
        loads: Array = parts.reshape(-1, self.motion.q.shape[1], len(pi)).max(axis=0)
        return loads


def measure_cost(tau: Array, v: Array, control_period: float) -> tuple[float, float]:
    """Absolute work, [J], and integral of |tau|^2 dt, [N^2 m^2 s], of a motion that was logged every control period.

    Torque is constant in a control period, and velocities are all but linear in it.

    Args:
        tau: Torques over the period that ends at each time, (N, num_joints), [N m]; the first row does not count.
        v: Joint velocities, (N, num_joints), [rad/s].
        control_period: Time between two rows, [s].
    """
    rates = np.abs(v)
    mean_rates = 0.5 * (rates[1:] + rates[:-1])
    return float(control_period * np.sum(np.abs(tau[1:]) * mean_rates)), float(control_period * np.sum(tau[1:] ** 2))
