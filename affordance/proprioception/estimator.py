"""Recursive Bayesian estimator of a held object's densities.

Within a trial it averages, sample by sample; the posterior at any time follows from the mean so far and the belief
at the start of the trial, so that the recursion is exact. Errors that grow with torque depend on the unknown
densities: their size is evaluated at the posterior mean, iterated to a fixed point. The object's own deviation from
its materials' means is a nuisance: it is marginalised, so an odd object moves a material as Bayes' rule requires.
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
    """Applies Bayes' rule to the torques measured in a trial so far; deviations of density as fractions.

    Before the first sample the prior is returned, with zero log evidence and a p-value of 1. If no fixed point of the
    errors' size is found, an AffordanceError is raised.
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
