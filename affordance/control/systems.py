"""Drake system of the controller in figure 2 of the paper."""

import dataclasses
import logging
import math
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues

from affordance.arrays import Array
from affordance.belief.density_belief import PointEstimate
from affordance.belief.object_belief import ObjectBelief
from affordance.control.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.control.problem import MpcSettings
from affordance.control.task import Task
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.plant.arm import Arm
from affordance.plant.arm_model import HeldTorqueModel

_LOG = logging.getLogger(__name__)


class ControlCounts(NamedTuple):
    """Numbers of control periods with an active limit, and with a failure of the planner."""

    limited: int
    failed: int


class MpcController(SampledSystem):
    """Model predictive controller, which plans once per control period with the believed inertia.

    The torque is constant within a control period. The previous plan continues if the task chooses a horizon of zero,
    or if the solver fails, which is logged as a warning. The discrete state consists of the torque, the plan, and
    counts of control periods. The seed for sampled densities is a parameter of the Context. Only one Context may be
    simulated at a time, because all Contexts share the model and the planners.

    Input ports:
        belief: Belief about the object, ObjectBelief.
        goal: Task of the controller, Task.
        state: True joint angles and velocities, (2 num_joints,), [rad, rad/s].

    Output ports:
        tau: Torques, (num_joints,), [N m].
    """

    def __init__(
        self,
        arm: Arm,
        *,
        settings: MpcSettings,
        control_period: float,
        point_estimate: PointEstimate,
        angle_margin: float,
    ) -> None:
        super().__init__()
        self._model = HeldTorqueModel(arm, control_period)
        self._limits = arm.shrink_limits(angle_margin, arm.home)
        self._settings = settings
        self._control_period = control_period
        # Planners by horizon in control periods; each is built at first use.
        self._mpcs: dict[int, MinimumAccelerationMpc] = {}
        self._get_mpc(settings.horizon)
        self._num_joints = arm.num_joints
        self._point_estimate = point_estimate
        n, N = arm.num_joints, settings.num_steps
        self._shown_payload: Array | None = None
        self._belief: Source[ObjectBelief] = self.declare_object_input("belief")
        self._goal: Source[Task] = self.declare_object_input("goal")
        self._state = self.declare_vector_input("state", 2 * n)
        tau = self.DeclareDiscreteState(n)
        self._tau = int(tau)
        self._plan = int(self.DeclareDiscreteState(N * n))
        # Time at which the plan was made, and its horizon.
        self._made = int(self.DeclareDiscreteState(np.array([0.0, settings.horizon])))
        self._counts = int(self.DeclareDiscreteState(2))  # numbers of limited and of failed control periods
        # Seed of the density that is drawn if the point estimate is a sample.
        self.seed: ObjectParameter[tuple[int, ...]] = self.declare_object_parameter((0,))
        self._payload = self.declare_cached(
            "payload", self._calc_payload, {self.input_ticket("belief"), self.seed.ticket}
        )
        self.DeclareStateOutputPort("tau", tau)
        self.DeclarePeriodicDiscreteUpdateEvent(control_period, 0.0, self._update)

    def get_counts(self, context: Context) -> ControlCounts:
        """Returns the numbers of control periods with an active limit, and with a failure of the planner."""
        limited, failed = context.get_discrete_state(self._counts).value()
        return ControlCounts(int(limited), int(failed))

    def _calc_payload(self, context: Context) -> Array:
        """Computes inertial parameters at the point estimate of the belief."""
        belief = self._belief.Eval(context)
        rng = np.random.default_rng(self.seed.get(context))
        return belief.compute_parameters(belief.densities.compute_point_estimate(self._point_estimate, rng))

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        payload = self._payload.get(context)
        if payload is not self._shown_payload:
            self._model.set_payload(payload)
            self._shown_payload = payload
        x = self._state.Eval(context)
        if not math.isfinite(x.dot(x)):  # Drake aborts the process if a plant is set to such a state
            self._count_failure(context, discrete_state, "the state is not finite; the torque is unchanged")
            return
        now, task = context.get_time(), self._goal.Eval(context)
        horizon = task.choose_horizon(now, self._settings.horizon)
        if horizon == 0.0:
            self._continue_plan(context, discrete_state, x)
            return
        goal = task.compute_goal(self._model, x, now, horizon)
        solution = self._get_mpc(horizon).solve(x, goal, self._model)
        if solution.status is MpcStatus.FAILED:
            self._count_failure(context, discrete_state, "the solver failed; the previous plan continues")
            self._continue_plan(context, discrete_state, x)
            return
        discrete_state.set_value(self._tau, solution.tau)
        discrete_state.set_value(self._plan, solution.vdot.ravel())
        discrete_state.set_value(self._made, np.array([now, horizon]))
        if solution.status is MpcStatus.LIMITED:
            limited, failed = context.get_discrete_state(self._counts).value()
            discrete_state.set_value(self._counts, np.array([limited + 1, failed]))

    def _get_mpc(self, horizon: float) -> MinimumAccelerationMpc:
        ticks = round(horizon / self._control_period)
        if ticks not in self._mpcs:
            settings = dataclasses.replace(self._settings, horizon=ticks * self._control_period)
            self._mpcs[ticks] = MinimumAccelerationMpc(self._limits, settings)
        return self._mpcs[ticks]

    def _continue_plan(self, context: Context, discrete_state: DiscreteValues, x: Array) -> None:
        """Sets the torque from the previous plan."""
        made, horizon = context.get_discrete_state(self._made).value()
        plan = context.get_discrete_state(self._plan).value().reshape(-1, self._num_joints)
        vdot = self._get_mpc(horizon).continue_plan(plan, context.get_time() - made)
        tau_max = self._limits.tau_max
        tau = np.clip(self._model.compute_held_torque(x, vdot), -tau_max, tau_max)
        discrete_state.set_value(self._tau, tau)

    def _count_failure(self, context: Context, discrete_state: DiscreteValues, reason: str) -> None:
        _LOG.warning("t = %.3f s: no new plan, because %s", context.get_time(), reason)
        limited, failed = context.get_discrete_state(self._counts).value()
        discrete_state.set_value(self._counts, np.array([limited, failed + 1]))
