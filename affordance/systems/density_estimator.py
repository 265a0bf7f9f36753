"""The proprioceptive system of the paper's figure 2: the recursive Bayesian estimator."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from affordance.arm import Arm, ArmModel
from affordance.estimator import Inference, Percept, infer
from affordance.noise import NoiseModel
from affordance.object_belief import ObjectBelief
from affordance.regressor import compute_payload_regressor
from affordance.sample_check import Verdict, judge_reading, judge_torque
from affordance.systems.sampled_system import SampledSystem, Source

Array = NDArray[np.float64]


class SampleCounts(NamedTuple):
    """How many samples of a trial were refused, and why, and how many were taken."""

    missing: int
    not_finite: int
    impossible: int
    accepted: int

    @property
    def rejected(self) -> int:
        """How many were refused."""
        return self.missing + self.not_finite + self.impossible


class DensityEstimator(SampledSystem):
    """Averages what is felt sample by sample, and applies Bayes' rule to it when asked.

    Its discrete state is the percept: the mean features felt so far, and how many samples they are the mean of; and
    counts of samples that were refused and taken.

    Input ports:
        prior: Belief before anything was felt, ObjectBelief.
        sensation: Felt torques, then angles and rates, then accelerations, (4 num_joints,).

    Output ports:
        posterior: Belief after what was felt, ObjectBelief.
        log_evidence: Log probability of what was felt, (1,).
        p_value: Probability of evidence as low as this, under what was believed, (1,).
    """

    def __init__(self, arm: Arm, *, noise: NoiseModel, deviation_sd: float, sample_period: float) -> None:
        super().__init__()
        self._model = ArmModel(arm)
        self._num_joints = arm.num_joints
        self._noise = noise
        self._deviation_sd = deviation_sd
        self._prior: Source[ObjectBelief] = self.declare_object_input("prior")
        self._sensation = self.declare_vector_input("sensation", 4 * arm.num_joints)
        percept = self.DeclareDiscreteState(noise.num_features(arm.num_joints) + 1)
        self._percept = int(percept)
        self._counts = int(self.DeclareDiscreteState(len(Verdict)))
        self.DeclarePeriodicDiscreteUpdateEvent(sample_period, sample_period, self._update_percept)
        self._inference = self.declare_cached(
            "inference", self._infer, {self.discrete_state_ticket(percept), self.input_ticket("prior")}
        )
        self.declare_object_output("posterior", self._calc_posterior, {self._inference.ticket})
        self.DeclareVectorOutputPort(
            "log_evidence", 1, self._calc_log_evidence, prerequisites_of_calc={self._inference.ticket}
        )
        self.DeclareVectorOutputPort("p_value", 1, self._calc_p_value, prerequisites_of_calc={self._inference.ticket})

    def get_counts(self, context: Context) -> SampleCounts:
        """Returns what became of the samples so far."""
        return SampleCounts(*(int(count) for count in context.get_discrete_state(self._counts).value()))

    def _update_percept(self, context: Context, discrete_state: DiscreteValues) -> None:
        n = self._num_joints
        sensation = self._sensation.Eval(context)
        tau, x, vdot = sensation[:n], sensation[n : 3 * n], sensation[3 * n :]
        verdict = judge_reading(tau)
        if verdict is Verdict.ACCEPTED:
            Y = compute_payload_regressor(self._model, x, vdot)
            tau_arm = self._model.compute_inverse_dynamics(vdot)
            verdict = judge_torque(tau, tau_arm, Y, self._prior.Eval(context).geometry, self._noise)
        counts = np.array(context.get_discrete_state(self._counts).value())
        counts[verdict.value] += 1.0
        discrete_state.set_value(self._counts, counts)
        if verdict is Verdict.ACCEPTED:
            percept = self._get_percept(context).add(self._noise.compute_features(tau, tau_arm, Y))
            discrete_state.set_value(self._percept, np.append(percept.features, percept.num_samples))

    def _get_percept(self, context: Context) -> Percept:
        state = context.get_discrete_state(self._percept).value()
        return Percept(state[:-1], int(state[-1]))

    def _infer(self, context: Context) -> Inference:
        percept = self._get_percept(context)
        return infer(self._prior.Eval(context), percept, self._num_joints, self._noise, self._deviation_sd)

    def _calc_posterior(self, context: Context) -> ObjectBelief:
        return self._inference.get(context).posterior

    def _calc_log_evidence(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._inference.get(context).log_evidence]))

    def _calc_p_value(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array([self._inference.get(context).p_value]))
