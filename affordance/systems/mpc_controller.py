"""The control system of the paper's figure 2: model predictive control with the believed inertia."""

import logging
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import AbstractParameterIndex, Context, DiscreteValues, ValueProducer

from affordance.acceleration_program import MpcSettings
from affordance.arm import Arm, ArmModel
from affordance.belief import Point
from affordance.mpc import MinimumAccelerationMpc, MpcStatus
from affordance.systems.sampled_system import SampledSystem
from affordance.visual_prior import ObjectBelief

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
        goal: The task.
        state: True joint angles and rates, (2 num_joints,), [rad, rad/s].

    Output ports:
        tau: Torques, (num_joints,), [N m].
    """

    def __init__(self, arm: Arm, settings: MpcSettings, tick: float, point: Point) -> None:
        super().__init__()
        self._model = ArmModel(arm)
        self._mpc = MinimumAccelerationMpc(arm.limits, settings)
        self._tick = tick
        self._num_joints = arm.num_joints
        self._point = point
        n, N = arm.num_joints, settings.num_steps
        self._shown_payload: Array | None = None
        self._belief = self.DeclareAbstractInputPort("belief", Value[object]())
        self._goal = self.DeclareAbstractInputPort("goal", Value[object]())
        self._state = self.DeclareVectorInputPort("state", 2 * n)
        self._tau = self.DeclareDiscreteState(n)
        self._plan = self.DeclareDiscreteState(N * n)
        self._counts = self.DeclareDiscreteState(3)  # ticks limited, ticks failed, ticks since the plan was made
        self._seed = self.DeclareAbstractParameter(AbstractValue.Make((0,)))
        self._payload = self.DeclareCacheEntry(
            "payload",
            ValueProducer(allocate=lambda: Value[object](), calc=self._calc_payload),
            {
                self.input_port_ticket(self._belief.get_index()),
                self.abstract_parameter_ticket(AbstractParameterIndex(self._seed)),
            },
        )
        self.DeclareStateOutputPort("tau", self._tau)
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)

    def set_seed(self, context: Context, seed: tuple[int, ...]) -> None:
        """Sets the seed of the density that is drawn if the point of the belief is a sample."""
        context.get_mutable_abstract_parameter(self._seed).set_value(seed)

    def get_counts(self, context: Context) -> TickCounts:
        """Returns how many ticks were limited and failed so far."""
        limited, failed, _ = context.get_discrete_state(self._counts).value()
        return TickCounts(int(limited), int(failed))

    def _calc_payload(self, context: Context, output: Value) -> None:
        """The inertial parameters at the chosen point of the belief; computed once per belief."""
        belief: ObjectBelief = self._belief.Eval(context)
        rng = np.random.default_rng(context.get_abstract_parameter(self._seed).get_value())
        output.set_value(belief.compute_parameters(belief.densities.choose(self._point, rng)))

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        payload = self._payload.Eval(context)
        if payload is not self._shown_payload:
            self._model.set_payload(payload)
            self._shown_payload = payload
        x = self._state.Eval(context)
        self._model.set_state(x)
        goal = self._goal.Eval(context).compute_goal(self._model, x)
        solution = self._mpc.solve(x, goal, self._model)
        if solution.status is MpcStatus.FAILED:
            self._go_on(context, x, discrete_state)
            return
        discrete_state.set_value(self._tau, solution.tau)
        discrete_state.set_value(self._plan, solution.vdot.ravel())
        limited, failed, age = context.get_discrete_state(self._counts).value()
        is_limited = solution.status is MpcStatus.LIMITED
        if is_limited or age > 0:
            discrete_state.set_value(self._counts, [limited + is_limited, failed, 0])

    def _go_on(self, context: Context, x: Array, discrete_state: DiscreteValues) -> None:
        """Follows the previous plan, or keeps the last torque if the state itself is not finite."""
        limited, failed, age = context.get_discrete_state(self._counts).value()
        _LOG.warning("t = %.3f s: the controller's solver failed; the previous plan goes on", context.get_time())
        discrete_state.set_value(self._counts, [limited, failed + 1, age + 1])
        if np.isfinite(x).all():
            plan = context.get_discrete_state(self._plan).value().reshape(-1, self._num_joints)
            tau = self._mpc.continue_plan(plan, (age + 1) * self._tick, self._model)
            discrete_state.set_value(self._tau, tau)
