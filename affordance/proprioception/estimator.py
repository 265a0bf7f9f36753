"""Recursive Bayesian estimator of a held object's densities from joint torques.

During a trial, the estimator updates the mean of torque features with each sample. The posterior at any time depends
only on this mean and on the holds before the trial, so the recursion is exact. The memory integrates over the unknown
densities, because torque errors can depend on them, and over differences between objects made of the same material.
The mean torque of a hold counts as one measurement for any number of samples.

Call sequence from torques to the memory: compute_posterior -> NoiseModel.describe -> MaterialMemory.learn ->
Learner.learn (OneDensity) -> exact.compute_posterior. At the end of a hold, MaterialMemorySystem stores the result.
"""

from dataclasses import replace
from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.proprioception.torque_noise import NoiseModel


class TorqueStatistics(NamedTuple):
    """Sufficient statistics of the torques measured so far in a trial."""

    features: Array  # running mean of the noise model's features, shape (num_features,)
    num_samples: int  # number of samples in the mean

    def add(self, features: Array) -> "TorqueStatistics":
        """Returns the statistics after one more sample with the given features, shape (num_features,)."""
        num_samples = self.num_samples + 1
        return TorqueStatistics(self.features + (features - self.features) / num_samples, num_samples)


class Inference(NamedTuple):
    """Result of inference from one trial."""

    posterior: ObjectBelief  # belief about the object and, in its memory, about all materials
    # Log probability density of the measurement under the prior; low for a surprising measurement.
    log_evidence: float
    p_value: float  # probability, under the prior, of evidence at most this high


def compute_posterior(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation: float
) -> Inference:
    """Computes the posterior given all torques of a trial so far.

    Args:
        prior: Belief at the start of the trial.
        statistics: Sufficient statistics of the torques. If there is no sample, the result is the prior, with zero
            log evidence and a p-value of 1.
        num_joints: Number of joints.
        noise: Model of torque errors.
        deviation: SD of an object's density about its material's mean, as a fraction of the mean.
    """
    if statistics.num_samples == 0:
        return Inference(prior, 0.0, 1.0)
    posterior, likelihood = condition_on_torques(prior, statistics, num_joints, noise, deviation)
    densities = prior.densities
    return Inference(posterior, densities.compute_log_evidence(likelihood), densities.compute_p_value(likelihood))


def condition_on_torques(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation: float
) -> tuple[ObjectBelief, Likelihood]:
    """Computes the posterior and the likelihood, but not the evidence, which is slow to compute.

    At least one sample is required. Arguments are the same as for ``compute_posterior``.
    """
    felt = noise.describe(statistics.features, statistics.num_samples, num_joints, prior.geometry)
    lesson = prior.memory.learn(felt, deviation)
    return replace(prior, memory=lesson.memory, densities=lesson.densities), lesson.likelihood
