"""Recursive Bayesian estimator of a held object's densities from joint torques.

Within a trial, the estimator averages features of the torques sample by sample. The posterior at any time follows
from this average and all holds before the trial, so the recursion is exact. The size of errors that grow with torque
depends on the unknown densities, and so does the scatter of objects about their materials' means; the memory
integrates over both. The average of a hold is one measurement, whatever its number of samples.

From torques to the memory: compute_posterior -> NoiseModel.describe -> MaterialMemory.learn -> Learner.learn
(OneDensity) -> exact.compute_posterior; at the end of a hold MaterialMemorySystem keeps the result.
"""

from dataclasses import replace
from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.proprioception.torque_noise import NoiseModel


class TorqueStatistics(NamedTuple):
    """Sufficient statistics of the torques measured in a trial so far."""

    features: Array  # running mean of the noise model's features, shape (num_features,)
    num_samples: int  # number of samples in the mean

    def add(self, features: Array) -> "TorqueStatistics":
        """Returns the statistics after one more sample, with features of shape (num_features,)."""
        num_samples = self.num_samples + 1
        return TorqueStatistics(self.features + (features - self.features) / num_samples, num_samples)


class Inference(NamedTuple):
    """Result of the inference from one trial."""

    posterior: ObjectBelief  # belief about the object and, in its memory, about all materials
    # Log probability density of the measurement under the prior; a low value means that it is surprising.
    log_evidence: float
    p_value: float  # probability, under the prior, of evidence as low as this


def compute_posterior(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation: float
) -> Inference:
    """Computes the posterior from the torques of a trial so far, by Bayes' rule.

    Args:
        prior: Belief at the start of the trial.
        statistics: Sufficient statistics of the torques; without a sample the prior is returned, with zero log
            evidence and a p-value of 1.
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
    """Computes the posterior and its likelihood, without the evidence.

    The evidence takes most of the time to compute.

    Arguments are as in compute_posterior; at least one sample is required.
    """
    felt = noise.describe(statistics.features, statistics.num_samples, num_joints, prior.geometry)
    lesson = prior.memory.learn(felt, deviation)
    return replace(prior, memory=lesson.memory, densities=lesson.densities), lesson.likelihood
