"""Proprioception: what the joints feel."""

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from affordance.faults import NO_FAULTS, Faults
from affordance.noise import NoiseModel
from affordance.systems.sampled_system import ObjectParameter, SampledSystem

Array = NDArray[np.float64]


class Proprioception(SampledSystem):
    """Adds the noise of feeling to the joints' torques; angles, rates and accelerations are felt as they are.

    The errors that last a trial and the seed of those that do not are parameters of the Context. Where torques arrive
    late, those on their way are its discrete state. A torque that did not arrive is NaN.

    Input ports:
        state: True joint angles and rates, (2 num_joints,), [rad, rad/s].
        tau: True torques, (num_joints,), [N m].
        vdot: True joint accelerations, (num_joints,), [rad/s^2].

    Output ports:
        sensation: Felt torques, then angles and rates, then accelerations, (4 num_joints,).
    """

    def __init__(
        self,
        num_joints: int,
        noise: NoiseModel,
        sample_period: float,
        faults: Faults = NO_FAULTS,
        stuck: int | None = None,
    ) -> None:
        super().__init__()
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
        self._seed: ObjectParameter[tuple[int, ...]] = self.declare_object_parameter((0,))
        self.DeclareVectorOutputPort("sensation", 4 * num_joints, self._calc_sensation)
        if faults.delay_samples:
            self._late = int(self.DeclareDiscreteState(np.full(faults.delay_samples * num_joints, np.nan)))
            self.DeclarePeriodicDiscreteUpdateEvent(sample_period, sample_period, self._update_late)

    def draw_errors(self, context: Context, seed: tuple[int, ...]) -> None:
        """Draws the errors of a trial from a seed."""
        gain, offset = self._noise.draw_trial_errors(seed, self._num_joints)
        context.get_mutable_numeric_parameter(self._gain_error).SetFromVector(gain)
        context.get_mutable_numeric_parameter(self._offset_error).SetFromVector(offset)
        self._seed.set(context, seed)

    def _calc_sensation(self, context: Context, output: BasicVector) -> None:
        felt = self._feel(context)
        if self._faults != NO_FAULTS:
            # Longer by one than the seeds of errors of feeling, so that the two are drawn apart.
            seed = (*self._seed.get(context), self._count_samples(context), 1)
            if self._faults.delay_samples:
                felt = context.get_discrete_state(self._late).value()[: self._num_joints]
            felt = self._faults.distort(felt, self._noise.compute_sd(self._tau.Eval(context)), self._stuck, seed)
        output.SetFromVector(np.concatenate([felt, self._state.Eval(context), self._vdot.Eval(context)]))

    def _feel(self, context: Context) -> Array:
        """Torques with the noise of feeling, (num_joints,), [N m]."""
        tau = self._tau.Eval(context)
        gain = context.get_numeric_parameter(self._gain_error).value()
        offset = context.get_numeric_parameter(self._offset_error).value()
        felt = tau * (1.0 + gain) + offset
        # The trial's seed and the sample's number decide, so that replays of a Context agree.
        seed = (*self._seed.get(context), self._count_samples(context))
        error = self._noise.draw_sample_error(seed, self._num_joints)
        return felt if error is None else felt + error

    def _count_samples(self, context: Context) -> int:
        return round(context.get_time() / self._sample_period)

    def _update_late(self, context: Context, discrete_state: DiscreteValues) -> None:
        """Sends off what is felt now, behind what is on its way."""
        on_their_way = context.get_discrete_state(self._late).value()
        discrete_state.set_value(self._late, np.concatenate([on_their_way[self._num_joints :], self._feel(context)]))
