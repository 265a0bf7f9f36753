"""The control system of the paper's figure 2: model predictive control with the believed inertia."""

import logging
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context, DiscreteValues

from affordance.acceleration_program import MpcSettings
from affordance.arm import Arm, ArmModel
from affordance.belief import Point
from affordance.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.object_belief import ObjectBelief
from affordance.systems.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.tasks.task import Task

Array = NDArray[np.float64]

_LOG = logging.getLogger(__name__)


class TickCounts(NamedTuple):
    """How many ticks of a trial had a limit active, and in how many the solver failed."""

    limited: int
    failed: int


class MpcController(SampledSystem):
    """Replans at every tick and holds the first torque until the next.

    Its discrete state is the torque held, the plan it is the beginning of, and counts of ticks. Should the solver
    fail, the previous plan goes on and a warning is logged. The seed of a sampled density is a parameter of the
    Context.

    Input ports:
        belief: What is believed of the object, ObjectBelief.
        goal: The Task.
        state: True joint angles and rates, (2 num_joints,), [rad, rad/s].

    Output ports:
        tau: Torques, (num_joints,), [N m].
    """

    def __init__(self, arm: Arm, *, settings: MpcSettings, tick: float, point: Point) -> None:
        super().__init__()
        self._model = ArmModel(arm)
        self._mpc = MinimumAccelerationMpc(arm.limits, settings)
        self._tick = tick
        self._num_joints = arm.num_joints
        self._point = point
        n, N = arm.num_joints, settings.num_steps
        self._shown_payload: Array | None = None
        self._belief: Source[ObjectBelief] = self.declare_object_input("belief")
        self._goal: Source[Task] = self.declare_object_input("goal")
        self._state = self.declare_vector_input("state", 2 * n)
        tau = self.DeclareDiscreteState(n)
        self._tau = int(tau)
        self._plan = int(self.DeclareDiscreteState(N * n))
        # Ticks limited, ticks failed; how many failed in a row at the last failure, and its time.
        self._counts = int(self.DeclareDiscreteState(np.array([0.0, 0.0, 0.0, -np.inf])))
        self._seed: ObjectParameter[tuple[int, ...]] = self.declare_object_parameter((0,))
        self._payload = self.declare_cached(
            "payload", self._calc_payload, {self.input_ticket("belief"), self._seed.ticket}
        )
        self.DeclareStateOutputPort("tau", tau)
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)

    def set_seed(self, context: Context, seed: tuple[int, ...]) -> None:
        """Sets the seed of the density that is drawn if the point of the belief is a sample."""
        self._seed.set(context, seed)

    def get_counts(self, context: Context) -> TickCounts:
        """Returns how many ticks were limited and failed so far."""
        limited, failed, _, _ = context.get_discrete_state(self._counts).value()
        return TickCounts(int(limited), int(failed))

    def _calc_payload(self, context: Context) -> Array:
        """The inertial parameters at the chosen point of the belief; computed once per belief."""
        belief = self._belief.Eval(context)
        rng = np.random.default_rng(self._seed.get(context))
        return belief.compute_parameters(belief.densities.choose(self._point, rng))

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        payload = self._payload.get(context)
        if payload is not self._shown_payload:
            self._model.set_payload(payload)
            self._shown_payload = payload
        x = self._state.Eval(context)
        if not math.isfinite(x @ x):  # Drake ends the process if a plant is set to such a state
            self._go_on(context, discrete_state, "the state is not finite")
            return
        self._model.set_state(x)
        task, horizon = self._goal.Eval(context), self._mpc.settings.horizon
        goal = task.compute_goal(self._model, x, context.get_time(), horizon)
        solution = self._mpc.solve(x, goal, self._model)
        if solution.status is MpcStatus.FAILED:
            self._go_on(context, discrete_state, "the solver failed", self._model)
            return
        discrete_state.set_value(self._tau, solution.tau)
        discrete_state.set_value(self._plan, solution.vdot.ravel())
        if solution.status is MpcStatus.LIMITED:
            limited, *failures = context.get_discrete_state(self._counts).value()
            discrete_state.set_value(self._counts, np.array([limited + 1, *failures]))

    def _go_on(
        self, context: Context, discrete_state: DiscreteValues, reason: str, model: ArmModel | None = None
    ) -> None:
        """Goes on without a new plan: along the previous one, or without a model with the last torque."""
        now = context.get_time()
        limited, failed, run, last = context.get_discrete_state(self._counts).value()
        run = run + 1 if now - last < 1.5 * self._tick else 1
        _LOG.warning("t = %.3f s: no new plan, as %s; the previous one goes on", now, reason)
        discrete_state.set_value(self._counts, np.array([limited, failed + 1, run, now]))
        if model is not None:
            plan = context.get_discrete_state(self._plan).value().reshape(-1, self._num_joints)
            discrete_state.set_value(self._tau, self._mpc.continue_plan(plan, run * self._tick, model))
