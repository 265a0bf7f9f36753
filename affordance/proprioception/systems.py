"""Proprioceptive systems of the paper's figure 2: sensing, and the recursive Bayesian estimator."""

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


class SampleCounts(NamedTuple):
    """Numbers of accepted samples in a trial, and of rejected ones by reason."""

    missing: int
    not_finite: int
    impossible: int
    accepted: int

    @property
    def rejected(self) -> int:
        """Number of rejected samples."""
        return self.missing + self.not_finite + self.impossible


class DensityEstimator(SampledSystem):
    """Recursive Bayesian estimator of an object's densities.

    The discrete state consists of the sufficient statistic of the presentation so far (mean features of the samples
    and their number) and of counts of accepted and rejected samples. The posterior is an output, computed from
    statistic and prior on demand. When the presentation ends, evidence and p-value are stored and the statistic is
    reset in the same event in which the memory stores the posterior, so that nothing is counted twice.

    Input ports:
        prior: Belief before the first sample, ObjectBelief.
        measurement: Measured torques, joint angles, velocities and accelerations, (4 num_joints,).

    Output ports:
        posterior: Belief given the samples so far, ObjectBelief.
        log_evidence: Log probability density of the samples under the prior, (1,).
        p_value: Probability, under the prior, of samples at least as improbable as these, (1,).
    """

    def __init__(
        self, arm: Arm, *, noise: NoiseModel, deviation: float, sample_period: float, duration: float
    ) -> None:
        """Declares states, ports and events; deviations of density as fractions of material means, times in [s]."""
        super().__init__()
        self._model = ArmModel(arm)
        self._num_joints = arm.num_joints
        self._noise = noise
        self._deviation = deviation
        self._prior: Source[ObjectBelief] = self.declare_object_input("prior")
        self._measurement = self.declare_vector_input("measurement", 4 * arm.num_joints)
        statistics = self.DeclareDiscreteState(noise.num_features(arm.num_joints) + 1)
        self._statistics = int(statistics)
        self._counts = int(self.DeclareDiscreteState(len(SampleStatus)))
        self._evidence = int(self.DeclareDiscreteState(np.array([0.0, 1.0])))
        self._last = int(self.DeclareDiscreteState(noise.num_features(arm.num_joints) + 1))
        self.DeclarePeriodicDiscreteUpdateEvent(sample_period, sample_period, self._update_statistics)
        self.DeclarePeriodicUnrestrictedUpdateEvent(duration, duration, self._end_presentation)
        self._inference = self.declare_cached(
            "inference", self._compute_inference, {self.discrete_state_ticket(statistics), self.input_ticket("prior")}
        )
        self.declare_object_output("posterior", self._calc_posterior, {self._inference.ticket})
        self.DeclareVectorOutputPort(
            "log_evidence", 1, self._calc_log_evidence, prerequisites_of_calc={self._inference.ticket}
        )
        self.DeclareVectorOutputPort("p_value", 1, self._calc_p_value, prerequisites_of_calc={self._inference.ticket})

    def get_counts(self, context: Context) -> SampleCounts:
        """Returns the numbers of accepted and rejected samples."""
        return SampleCounts(*(int(count) for count in context.get_discrete_state(self._counts).value()))

    def get_evidence(self, context: Context) -> tuple[float, float]:
        """Returns log evidence and p-value of the last complete presentation."""
        log_evidence, p_value = context.get_discrete_state(self._evidence).value()
        return float(log_evidence), float(p_value)

    def get_last_statistics(self, context: Context) -> TorqueStatistics:
        """Returns the statistics of the last complete presentation."""
        return self._read_statistics(context, self._last)

    def forget(self, context: Context) -> None:
        """Restarts the presentation: resets statistics and counts."""
        for group in (self._statistics, self._counts):
            context.SetDiscreteState(group, np.zeros(context.get_discrete_state(group).size()))

    def resume(self, context: Context) -> None:
        """Continues the last complete presentation, as if it had not ended."""
        context.SetDiscreteState(self._statistics, np.array(context.get_discrete_state(self._last).value()))

    def _update_statistics(self, context: Context, discrete_state: DiscreteValues) -> None:
        n = self._num_joints
        measurement = self._measurement.Eval(context)
        tau, x, vdot = measurement[:n], measurement[n : 3 * n], measurement[3 * n :]
        status = check_reading(tau)
        if status is SampleStatus.ACCEPTED:
            Y = compute_payload_regressor(self._model, x, vdot)
            tau_arm = self._model.compute_inverse_dynamics(vdot)
            status = check_torque(tau, tau_arm, Y, self._prior.Eval(context).geometry, self._noise)
        counts = np.array(context.get_discrete_state(self._counts).value())
        counts[status.value] += 1.0
        discrete_state.set_value(self._counts, counts)
        if status is SampleStatus.ACCEPTED:
            statistics = self.get_statistics(context).add(self._noise.compute_features(tau, tau_arm, Y))
            discrete_state.set_value(self._statistics, np.append(statistics.features, statistics.num_samples))

    def _end_presentation(self, context: Context, state: State) -> None:
        inference = self._inference.get(context)
        discrete: Any = state.get_mutable_discrete_state()
        discrete.set_value(self._evidence, np.array([inference.log_evidence, inference.p_value]))
        discrete.set_value(self._last, np.array(context.get_discrete_state(self._statistics).value()))
        discrete.set_value(self._statistics, np.zeros(context.get_discrete_state(self._statistics).size()))

    def get_statistics(self, context: Context) -> TorqueStatistics:
        """Returns the statistics of the torques measured so far."""
        return self._read_statistics(context, self._statistics)

    def _read_statistics(self, context: Context, group: int) -> TorqueStatistics:
        state = context.get_discrete_state(group).value()
        return TorqueStatistics(state[:-1], int(state[-1]))

    def _compute_inference(self, context: Context) -> Inference:
        prior, statistics = self._prior.Eval(context), self.get_statistics(context)
        return compute_posterior(prior, statistics, self._num_joints, self._noise, self._deviation)

    def _calc_posterior(self, context: Context) -> ObjectBelief:
        return self._inference.get(context).posterior

    def _calc_log_evidence(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._inference.get(context).log_evidence]))

    def _calc_p_value(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._inference.get(context).p_value]))


class Proprioception(SampledSystem):
    """Joint sensor that adds noise to torques and accelerations; angles and velocities are exact.

    The errors that last a trial, and the seed of the other errors, are parameters of the Context. If torques are
    delayed, those not yet delivered are the discrete state. A torque that did not arrive is NaN.

    Input ports:
        state: True joint angles and velocities, (2 num_joints,), [rad, rad/s].
        tau: True torques, (num_joints,), [N m].
        vdot: True joint accelerations, (num_joints,), [rad/s^2].

    Output ports:
        measurement: Measured torques, then angles and velocities, then accelerations, (4 num_joints,).
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
        self._faults = faults
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
        self.DeclareVectorOutputPort("measurement", 4 * num_joints, self._calc_measurement)
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

    def _calc_measurement(self, context: Context, output: BasicVector) -> None:
        felt = self._feel(context)
        if self._faults != NO_FAULTS:
            # One number longer than the seeds of sensing errors, so that faults and errors are independent.
            seed = (*self._seed.get(context), self._count_samples(context), 1)
            if self._faults.delay_samples:
                felt = context.get_discrete_state(self._late).value()[: self._num_joints]
            felt = self._faults.distort(felt, self._noise.compute_sd(self._tau.Eval(context)), self._stuck, seed)
        vdot = self._vdot.Eval(context) + context.get_numeric_parameter(self._acceleration_error).value()
        output.SetFromVector(np.concatenate([felt, self._state.Eval(context), vdot]))

    def _feel(self, context: Context) -> Array:
        """Returns the torques with sensing noise, shape (num_joints,), [N m]."""
        tau = self._tau.Eval(context)
        gain = context.get_numeric_parameter(self._gain_error).value()
        offset = context.get_numeric_parameter(self._offset_error).value()
        felt = tau * (1.0 + gain) + offset
        # The trial's seed and the sample's number determine the error, so that replays of a Context agree.
        seed = (*self._seed.get(context), self._count_samples(context))
        error = self._noise.draw_sample_error(seed, tau)
        return felt if error is None else felt + error

    def _count_samples(self, context: Context) -> int:
        return round(context.get_time() / self._sample_period)

    def _update_late(self, context: Context, discrete_state: DiscreteValues) -> None:
        """Appends the current measurement to the queue of delayed torques."""
        on_their_way = context.get_discrete_state(self._late).value()
        discrete_state.set_value(self._late, np.concatenate([on_their_way[self._num_joints :], self._feel(context)]))
