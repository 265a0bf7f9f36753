"""Proprioceptive systems of the paper's figure 2: joint sensing and the recursive Bayesian estimator."""

from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, State

from affordance.arrays import Array
from affordance.belief.object_belief import ObjectBelief
from affordance.drake.sampled_system import ObjectParameter, SampledSystem, Source
from affordance.plant.arm import Arm
from affordance.plant.arm_model import ArmModel, compute_payload_regressor
from affordance.proprioception.estimator import Inference, TorqueStatistics, compute_posterior
from affordance.proprioception.faults import NO_FAULTS, Faults
from affordance.proprioception.outlier_check import SampleStatus, check_reading, check_torque
from affordance.proprioception.torque_noise import NoiseModel, draw_acceleration_error
from affordance.runs.random_streams import Stream


class SampleCounts(NamedTuple):
    """Numbers of accepted and rejected samples in a trial, by reason for rejection."""

    missing: int
    not_finite: int
    impossible: int
    accepted: int

    @property
    def rejected(self) -> int:
        """Number of rejected samples."""
        return self.missing + self.not_finite + self.impossible


class DensityEstimator(SampledSystem):
    """Recursive Bayesian estimator of an object's densities from joint torques.

    The discrete state holds the sufficient statistics of the presentation so far (the mean features and the number of
    samples), and the counts of accepted and rejected samples. The posterior is computed from statistics and prior
    when the output is evaluated. A forced event ends the presentation: the memory stores the posterior, and the
    statistics are reset so that no sample counts twice.

    Input ports:
        prior: Belief before the first sample, ObjectBelief.
        tau: Measured torques, (num_joints,), [N m].
        state: Joint angles and velocities, (2 num_joints,), [rad, rad/s].
        vdot: Measured joint accelerations, (num_joints,), [rad/s^2].

    Output ports:
        posterior: Belief given the samples so far, ObjectBelief.
        p_value: Probability, under the prior, of samples at least as improbable as these, (1,).
    """

    def __init__(self, arm: Arm, *, noise: NoiseModel, deviation: float, sample_period: float) -> None:
        """Declares states, ports and events.

        Args:
            arm: Arm that holds the object.
            noise: Model of torque errors.
            deviation: SD of an object's density about its material's mean, as a fraction of the mean.
            sample_period: Time between two samples, [s].
        """
        super().__init__()
        self._model = ArmModel(arm)
        self._num_joints = arm.num_joints
        self._noise = noise
        self._deviation = deviation
        self._prior: Source[ObjectBelief] = self.declare_object_input("prior")
        self._tau = self.declare_vector_input("tau", arm.num_joints)
        self._state = self.declare_vector_input("state", 2 * arm.num_joints)
        self._vdot = self.declare_vector_input("vdot", arm.num_joints)
        statistics = self.DeclareDiscreteState(noise.num_features(arm.num_joints) + 1)
        self._statistics = int(statistics)
        self._counts = int(self.DeclareDiscreteState(len(SampleStatus)))
        self.DeclarePeriodicDiscreteUpdateEvent(sample_period, sample_period, self._update_statistics)
        self.DeclareForcedUnrestrictedUpdateEvent(self._end_presentation)
        self._inference = self.declare_cached(
            "inference", self._compute_inference, {self.discrete_state_ticket(statistics), self.input_ticket("prior")}
        )
        self.declare_object_output("posterior", self._calc_posterior, {self._inference.ticket})
        self.DeclareVectorOutputPort("p_value", 1, self._calc_p_value, prerequisites_of_calc={self._inference.ticket})

    def get_counts(self, context: Context) -> SampleCounts:
        """Returns the numbers of accepted and rejected samples."""
        return SampleCounts(*(int(count) for count in context.get_discrete_state(self._counts).value()))

    def get_inference(self, context: Context) -> Inference:
        """Returns the inference from the samples so far."""
        return self._inference.get(context)

    def get_statistics(self, context: Context) -> TorqueStatistics:
        """Returns the statistics of the torques measured so far."""
        state = context.get_discrete_state(self._statistics).value()
        return TorqueStatistics(state[:-1], int(state[-1]))

    def _update_statistics(self, context: Context, discrete_state: DiscreteValues) -> None:
        tau = self._tau.Eval(context)
        status = check_reading(tau)
        if status is SampleStatus.ACCEPTED:
            vdot = self._vdot.Eval(context)
            Y = compute_payload_regressor(self._model, self._state.Eval(context), vdot)
            tau_arm = self._model.compute_inverse_dynamics(vdot)
            status = check_torque(tau, tau_arm, Y, self._prior.Eval(context).geometry, self._noise)
        counts = np.array(context.get_discrete_state(self._counts).value())
        counts[status.value] += 1.0
        discrete_state.set_value(self._counts, counts)
        if status is SampleStatus.ACCEPTED:
            statistics = self.get_statistics(context).add(self._noise.compute_features(tau, tau_arm, Y))
            discrete_state.set_value(self._statistics, np.append(statistics.features, statistics.num_samples))

    def _end_presentation(self, context: Context, state: State) -> None:
        discrete: Any = state.get_mutable_discrete_state()
        discrete.set_value(self._statistics, np.zeros(context.get_discrete_state(self._statistics).size()))

    def _compute_inference(self, context: Context) -> Inference:
        prior, statistics = self._prior.Eval(context), self.get_statistics(context)
        return compute_posterior(prior, statistics, self._num_joints, self._noise, self._deviation)

    def _calc_posterior(self, context: Context) -> ObjectBelief:
        return self._inference.get(context).posterior

    def _calc_p_value(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._inference.get(context).p_value]))


class Proprioception(SampledSystem):
    """Joint sensor with noise on torques and accelerations. Angles and velocities are exact.

    With the default noise model, WeberNoise, the torque error is constant during a hold, so further samples do not
    average it out. The errors of a trial, and the seed of all other errors, are parameters of the Context. Delayed
    torques are stored in the discrete state until they are reported. A missing torque is NaN.

    Input ports:
        state: True joint angles and velocities, (2 num_joints,), [rad, rad/s].
        tau: True torques, (num_joints,), [N m].
        vdot: True joint accelerations, (num_joints,), [rad/s^2].

    Output ports:
        measured_tau: Measured torques, (num_joints,), [N m].
        measured_state: Angles and velocities, (2 num_joints,), [rad, rad/s].
        measured_vdot: Measured accelerations, (num_joints,), [rad/s^2].
    """

    def __init__(
        self,
        num_joints: int,
        noise: NoiseModel,
        sample_period: float,
        faults: Faults = NO_FAULTS,
        stuck: int | None = None,
        acceleration_sd: float = 0.0,
    ) -> None:
        super().__init__()
        self._acceleration_sd = acceleration_sd
        self._faults, self._is_faulty = faults, faults != NO_FAULTS
        self._stuck = stuck
        self._num_joints = num_joints
        self._noise = noise
        self._sample_period = sample_period
        self._state = self.declare_vector_input("state", 2 * num_joints)
        self._tau = self.declare_vector_input("tau", num_joints)
        self._vdot = self.declare_vector_input("vdot", num_joints)
        self._gain_error = self.DeclareNumericParameter(BasicVector(np.zeros(num_joints)))
        self._offset_error = self.DeclareNumericParameter(BasicVector(np.zeros(num_joints)))
        self._acceleration_error = self.DeclareNumericParameter(BasicVector(np.zeros(num_joints)))
        self._seed: ObjectParameter[tuple[int, ...]] = self.declare_object_parameter((0,))
        self.DeclareVectorOutputPort("measured_tau", num_joints, self._calc_tau)
        self.DeclareVectorOutputPort("measured_state", 2 * num_joints, self._calc_state)
        self.DeclareVectorOutputPort("measured_vdot", num_joints, self._calc_vdot)
        if faults.delay_samples:
            self._late = int(self.DeclareDiscreteState(np.full(faults.delay_samples * num_joints, np.nan)))
            self.DeclarePeriodicDiscreteUpdateEvent(sample_period, sample_period, self._update_late)

    def draw_errors(self, context: Context, seed: tuple[int, ...]) -> None:
        """Draws the errors of a trial from a seed, and stores them in the Context."""
        gain, offset = self._noise.draw_trial_errors(seed, self._num_joints)
        context.get_mutable_numeric_parameter(self._gain_error).SetFromVector(gain)
        context.get_mutable_numeric_parameter(self._offset_error).SetFromVector(offset)
        acceleration = draw_acceleration_error(self._acceleration_sd, seed, self._num_joints)
        context.get_mutable_numeric_parameter(self._acceleration_error).SetFromVector(acceleration)
        self._seed.set(context, seed)

    def _calc_tau(self, context: Context, output: BasicVector) -> None:
        felt = self._feel(context)
        if self._is_faulty:
            # The additional number makes faults independent of sensing errors.
            seed = (*self._seed.get(context), self._count_samples(context), Stream.FAULT)
            if self._faults.delay_samples:
                felt = context.get_discrete_state(self._late).value()[: self._num_joints]
            felt = self._faults.distort(felt, self._noise.compute_sd(self._tau.Eval(context)), self._stuck, seed)
        output.SetFromVector(felt)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._state.Eval(context))

    def _calc_vdot(self, context: Context, output: BasicVector) -> None:
        error = context.get_numeric_parameter(self._acceleration_error).value()
        output.SetFromVector(self._vdot.Eval(context) + error)

    def _feel(self, context: Context) -> Array:
        """Adds sensing noise to the true torques, shape (num_joints,), [N m]."""
        tau = self._tau.Eval(context)
        gain = context.get_numeric_parameter(self._gain_error).value()
        offset = context.get_numeric_parameter(self._offset_error).value()
        felt = tau * (1.0 + gain) + offset
        # The error depends only on the trial's seed and the sample's number, so replays of a Context are identical.
        seed = (*self._seed.get(context), self._count_samples(context))
        error = self._noise.draw_sample_error(seed, tau)
        return felt if error is None else felt + error

    def _count_samples(self, context: Context) -> int:
        return round(context.get_time() / self._sample_period)

    def _update_late(self, context: Context, discrete_state: DiscreteValues) -> None:
        """Appends the current measurement to the queue of delayed torques."""
        on_their_way = context.get_discrete_state(self._late).value()
        discrete_state.set_value(self._late, np.concatenate([on_their_way[self._num_joints :], self._feel(context)]))
