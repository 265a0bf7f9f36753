"""Online identification in a Diagram: every sample updates sums, from which a belief is computed on demand."""

from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, DiscreteValues
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from affordance.arrays import Array
from affordance.drake.sampled_system import SampledSystem
from affordance.identification.evidence.evidence import Evidence, build_error_model
from affordance.identification.evidence.fitted_arm import FittedArm, predict_friction
from affordance.identification.evidence.gains import Gains
from affordance.identification.evidence.joint_statistics import NUM_COLUMNS, JointStatistics, RunningSums
from affordance.identification.evidence.payload_likelihood import ChannelPrior
from affordance.identification.posterior.body_posterior import WeightedBodies, draw_bodies
from affordance.identification.posterior.part_posterior import (
    NotTheSeenObjectError,
    PartPosterior,
    PlacedObject,
    infer_parts,
)
from affordance.identification.posterior.payload_fit import fit_statistics
from affordance.identification.posterior.solid_prior import SolidPrior
from affordance.identification.settings import DEFAULT_SETTINGS, IdentificationSettings
from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.plant.chain_plant import build_arm
from affordance.plant.serial_chain import SerialChain

# Largest number of alternations between body and noise.
_MAX_ROUNDS = 10
# Probability of the samples below which the held object is not the one that the camera saw; five standard deviations.
_ANOTHER = 3e-7
# Number of samples, few enough that a belief takes some milliseconds.
_NUM_SAMPLES = 500


class LoadBelief(NamedTuple):
    """Belief about the load from the samples so far."""

    bodies: WeightedBodies  # samples of the ten parameters
    # Posterior of a seen object with its materials updated. None without a camera, as long as the belief is the
    # prior, and if no densities of the seen parts explain the load.
    parts: PartPosterior | None


class PayloadIdentifier(SampledSystem):
    """System that identifies an arm's payload sample by sample.

    The discrete state is the sums over all samples so far; nothing else evolves. No model of the empty arm is needed
    if a repeated empty run has already been subtracted from the signal (a replayed pair).

    Input ports:
        state: Joint angles and velocities, filtered like the signal, (2 n,), [rad, rad/s].
        vdot: Joint accelerations, (n,), [rad/s^2].
        signal: Torques or currents, (n,).

    Output ports:
        bodies: Posterior of the ten parameters, WeightedBodies; the prior until there are enough samples to estimate
            the noise.
        belief: Posterior of the ten parameters and of a seen object's materials, LoadBelief.
        statistics: Sums so far, JointStatistics.
    """

    def __init__(
        self,
        robot: SerialChain,
        prior: ChannelPrior,
        *,
        period: float,
        cutoff: float,
        least_variance: Array,
        fitted: FittedArm | None = None,
        solid: SolidPrior | None = None,
        placed: PlacedObject | None = None,
        deviation: float = 0.06,
        settings: IdentificationSettings = DEFAULT_SETTINGS,
    ) -> None:
        """Declares states, ports and events.

        Args:
            robot: Model of the arm, with gravity in its base frame.
            prior: Prior of gains, friction and model errors of the arm; it says whether the signal contains the arm's
                torque.
            period: Sampling period, [s].
            cutoff: Cut-off of the signals' low-pass filter, [Hz].
            least_variance: Lower bound of the long-run variance from earlier runs, (n,), [signal unit squared].
            fitted: Fitted empty arm whose prediction is subtracted; None to subtract nothing.
            solid: Prior of the body; None for any solid that a hand could hold.
            placed: Object that a camera saw, in the frame of the tip; None without a camera.
            deviation: Standard deviation of an object's density about its material's mean, as a fraction of it.
            settings: Identification settings.
        """
        super().__init__()
        n = robot.num_joints
        self._robot, self._prior, self._settings = robot, prior, settings
        self._fitted = fitted
        self._solid = SolidPrior.for_hand() if solid is None else solid
        self._placed, self._deviation = placed, deviation
        self._model = ArmModel(build_arm(robot))
        if fitted is not None:
            links = robot.link_parameters + fitted.link_change.reshape(n, -1)
            self._fitted_model = ArmModel(build_arm(robot, links))
        self._errors = build_error_model(1.0 / period, cutoff, least_variance, settings)
        self._block_length = max(1, round(settings.block / period))
        self._state = self.declare_vector_input("state", 2 * n)
        self._vdot = self.declare_vector_input("vdot", n)
        self._signal = self.declare_vector_input("signal", n)
        square = n * NUM_COLUMNS**2
        groups = [self.DeclareDiscreteState(size) for size in (square, square, n * NUM_COLUMNS, n + 1)]
        self._groups = tuple(int(group) for group in groups)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update_sums)
        tickets = {self.discrete_state_ticket(group) for group in groups}
        self._belief = self.declare_cached("belief", self._calc_belief, tickets)
        self.declare_object_output("belief", self._belief.get, tickets)
        self.declare_object_output("bodies", self._calc_bodies, tickets)
        self.declare_object_output("statistics", self._calc_statistics, tickets)

    def _update_sums(self, context: Context, discrete_state: DiscreteValues) -> None:
        n = self._robot.num_joints
        x, vdot, signal = self._state.Eval(context), self._vdot.Eval(context), self._signal.Eval(context)
        v = x[n:]
        Y = compute_payload_regressor(self._model, x, vdot)
        arm_torque = self._model.compute_inverse_dynamics(vdot)
        if self._fitted is not None:
            torque = self._fitted_model.compute_held_torque(x, vdot)
            signal = signal - self._fitted.gain * (torque + predict_friction(self._fitted, v, vdot, arm_torque))
        direction = np.sign(v)
        used = np.abs(v) >= self._settings.min_speed
        s = direction * np.sign(arm_torque)
        # The columns are those of ChannelSamples.build_columns, written out for speed, as every sample waits for
        # them.
        z = np.empty((n, NUM_COLUMNS))
        z[:, 0] = arm_torque
        z[:, 1:11] = Y
        z[:, 11:22] = s[:, None] * z[:, :11]
        z[:, 22], z[:, 23], z[:, 24], z[:, 25] = direction, v, 1.0, signal
        z[~used] = 0.0
        arrays = [discrete_state.get_mutable_vector(group).get_mutable_value() for group in self._groups]
        self._shape(arrays).add(z, used, self._block_length)

    def _shape(self, arrays: list[Array]) -> RunningSums:
        n = self._robot.num_joints
        products, block_products, block_sum, counts = arrays
        square = (n, NUM_COLUMNS, NUM_COLUMNS)
        return RunningSums(
            products.reshape(square), block_products.reshape(square), block_sum.reshape(n, NUM_COLUMNS), counts
        )

    def _calc_statistics(self, context: Context) -> JointStatistics:
        arrays = [np.array(context.get_discrete_state(group).value()) for group in self._groups]
        return self._shape(arrays).freeze(self._block_length)

    def _calc_bodies(self, context: Context) -> WeightedBodies:
        return self._belief.get(context).bodies

    def _calc_belief(self, context: Context) -> LoadBelief:
        statistics = self._calc_statistics(context)
        # The seed is a function of the sums, so that a replayed Context agrees.
        rng = np.random.default_rng((self._settings.seed, statistics.num_rows))
        if not self._errors.can_estimate(statistics):  # any load explains so few samples exactly
            return LoadBelief(self._draw_prior(rng), None)
        likelihood, mode, *_ = fit_statistics(
            statistics, self._errors, self._prior, self._solid, max_iterations=_MAX_ROUNDS
        )
        if self._placed is not None:
            try:
                parts = infer_parts(
                    likelihood,
                    self._placed,
                    deviation=self._deviation,
                    unseen_share=self._settings.unseen_share,
                    rng=rng,
                    num_samples=_NUM_SAMPLES,
                )
            except NotTheSeenObjectError:
                pass  # another object is held: the camera is ignored
            else:
                if parts.p_value >= _ANOTHER:
                    return LoadBelief(parts.bodies, parts)
        return LoadBelief(draw_bodies(likelihood, self._solid, mode, rng, _NUM_SAMPLES), None)

    def _draw_prior(self, rng: np.random.Generator) -> WeightedBodies:
        if self._placed is None:
            pi = self._solid.draw_parameters(rng, _NUM_SAMPLES)
        else:
            pi = self._placed.draw_parameters(rng, _NUM_SAMPLES, self._settings.unseen_share)
        return WeightedBodies(pi, np.full(len(pi), 1.0 / len(pi)), np.arange(len(pi)))


def build_replay(
    robot: SerialChain,
    evidence: Evidence,
    gains: Gains,
    prior: ChannelPrior,
    *,
    solid: SolidPrior | None = None,
    placed: PlacedObject | None = None,
    deviation: float = 0.06,
    settings: IdentificationSettings = DEFAULT_SETTINGS,
) -> tuple[Diagram, PayloadIdentifier]:
    """Builds a Diagram that replays a run's evidence into an identifier.

    The noise variance has that of the gains' calibration runs as its lower bound. The Diagram's time starts with the
    run. Arguments not described here are those of ``PayloadIdentifier``.
    """
    builder = DiagramBuilder()
    period = 1.0 / evidence.rate
    times = period * np.arange(len(evidence.prepared.times))
    identifier = PayloadIdentifier(
        robot,
        prior,
        period=period,
        cutoff=evidence.prepared.cutoff,
        least_variance=np.maximum(evidence.least_variance, gains.least_variance),
        solid=solid,
        placed=placed,
        deviation=deviation,
        settings=settings,
    )
    builder.AddNamedSystem("payload_identifier", identifier)
    q, v, vdot = evidence.prepared.motion
    recorded: dict[str, Any] = {"state": np.hstack([q, v]), "vdot": vdot, "signal": evidence.samples.signal}
    for name, values in recorded.items():
        trajectory = PiecewisePolynomial.FirstOrderHold(times.tolist(), values.T)
        source = builder.AddNamedSystem(f"recorded_{name}", TrajectorySource(trajectory))
        builder.Connect(source.get_output_port(), identifier.GetInputPort(name))
    diagram = builder.Build()
    diagram.set_name("payload_replay")
    return diagram, identifier
