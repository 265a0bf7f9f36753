"""Proprioception: what the joints feel."""

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import BasicVector, Context

from affordance.noise import NoiseModel
from affordance.systems.sampled_system import ObjectParameter, SampledSystem

Array = NDArray[np.float64]


class Proprioception(SampledSystem):
    """Adds the noise of feeling to the joints' torques; angles, rates and accelerations are felt as they are.

    The errors that last a trial and the seed of those that do not are parameters of the Context.

    Input ports:
        state: True joint angles and rates, (2 num_joints,), [rad, rad/s].
        tau: True torques, (num_joints,), [N m].
        vdot: True joint accelerations, (num_joints,), [rad/s^2].

    Output ports:
        sensation: Felt torques, then angles and rates, then accelerations, (4 num_joints,).
    """

    def __init__(self, num_joints: int, noise: NoiseModel, sample_period: float) -> None:
        super().__init__()
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

    def draw_errors(self, context: Context, seed: tuple[int, ...]) -> None:
        """Draws the errors of a trial from a seed."""
        gain, offset = self._noise.draw_trial_errors(seed, self._num_joints)
        context.get_mutable_numeric_parameter(self._gain_error).SetFromVector(gain)
        context.get_mutable_numeric_parameter(self._offset_error).SetFromVector(offset)
        self._seed.set(context, seed)

    def _calc_sensation(self, context: Context, output: BasicVector) -> None:
        tau = self._tau.Eval(context)
        gain = context.get_numeric_parameter(self._gain_error).value()
        offset = context.get_numeric_parameter(self._offset_error).value()
        felt = tau * (1.0 + gain) + offset
        # The trial's seed and the sample's number decide, so that replays of a Context agree.
        sample = round(context.get_time() / self._sample_period)
        error = self._noise.draw_sample_error((*self._seed.get(context), sample), self._num_joints)
        if error is not None:
            felt = felt + error
        output.SetFromVector(np.concatenate([felt, self._state.Eval(context), self._vdot.Eval(context)]))
