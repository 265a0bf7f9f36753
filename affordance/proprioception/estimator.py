"""Recursive Bayesian estimator of a held object's densities from joint torques.

Within a trial, the estimator averages features of the torques sample by sample. The posterior at any time follows
from this average and the belief at the start of the trial, so the recursion is exact. The size of errors that grow
with torque depends on the unknown densities: it is evaluated at the posterior mean, iterated to a fixed point. The
object's own deviation from its materials' means is a nuisance parameter and is marginalised, so that an odd object
updates the belief about a material by exactly as much as Bayes' rule prescribes. However many samples a hold has, its
average is one measurement.

From torques to the memory: compute_posterior -> MaterialMemory.learn -> Learner.learn (OneDensity) -> find_likelihood
-> find_fixed_point -> NoiseModel.compute_likelihood; at the end of a hold MaterialMemorySystem keeps the result.
"""

from dataclasses import replace
from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.torque_noise import NoiseModel


class TorqueStatistics(NamedTuple):
    """Sufficient statistics of the torques measured in a trial so far."""

    features: Array  # running mean of the noise model's features, shape (num_features,)
    num_samples: int  # number of samples in the mean

    def add(self, features: Array) -> "TorqueStatistics":
        """Returns the statistics with one more sample's features, shape (num_features,)."""
        num_samples = self.num_samples + 1
        return TorqueStatistics(self.features + (features - self.features) / num_samples, num_samples)


class Inference(NamedTuple):
    """Result of inference from a trial."""

    posterior: ObjectBelief  # belief about the object and, in its memory, about all materials
    # Log probability density of the measurement under the prior, with errors evaluated at the posterior mean; a low
    # value means that the measurement is surprising.
    log_evidence: float
    p_value: float  # probability, under the prior, of evidence as low as this


def compute_posterior(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation: float
) -> Inference:
    """Computes the posterior from the torques measured in a trial so far, by Bayes' rule.

    Args:
        prior: Belief at the start of the trial.
        statistics: Sufficient statistics of the torques; without a sample the prior is returned, with zero log
            evidence and a p-value of 1.
        num_joints: Number of joints.
        noise: Model of torque errors.
        deviation: SD of an object's density about its material's mean, as a fraction of the mean.

    Raises:
        AffordanceError: The iteration for the size of the errors finds no fixed point.
    """
    if statistics.num_samples == 0:
        return Inference(prior, 0.0, 1.0)
    posterior, likelihood = condition_on_torques(prior, statistics, num_joints, noise, deviation)
    densities = prior.densities
    return Inference(posterior, densities.compute_log_evidence(likelihood), densities.compute_p_value(likelihood))


def condition_on_torques(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation: float
) -> tuple[ObjectBelief, Likelihood]:
    """Returns the posterior and its likelihood, without the evidence, which takes most of the time to compute.

    Arguments and errors are those of compute_posterior; at least one sample is required.
    """
    features, num_samples = statistics

    def find_likelihood(belief: DensityBelief) -> Likelihood:
        return find_fixed_point(
            belief, lambda rho: noise.compute_likelihood(features, num_samples, num_joints, prior.geometry, rho)
        )

    lesson = prior.memory.learn(find_likelihood, deviation)
    return replace(prior, memory=lesson.memory, densities=lesson.densities), lesson.likelihood
