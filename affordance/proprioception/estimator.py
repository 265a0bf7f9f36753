"""The recursive Bayesian estimator of a held object's densities.

Within a trial it averages, sample by sample; the posterior at any time follows from the mean so far and the belief
the trial began with, so that the recursion is exact. Errors that grow with torque depend on the densities sought:
their size is evaluated at the posterior mean, iterated to a fixed point. The object's own deviation from its
materials' means is a nuisance: it is marginalised, so one odd object moves a material by what Bayes' rule says.
"""

from typing import NamedTuple

import numpy as np

from affordance.arrays import Array
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.exceptions import AffordanceError
from affordance.proprioception.torque_noise import NoiseModel

# What is felt in a hold takes tens; in a blow, of whose contact the estimator knows nothing, up to 300 were seen.
_MAX_ITERATIONS = 1000
_TOLERANCE = 1e-12


class TorqueStatistics(NamedTuple):
    """What a trial has felt so far.

    Attributes:
        features: Running mean of the noise model's features, shape (num_features,).
        num_samples: How many samples went into it.
    """

    features: Array
    num_samples: int

    def add(self, features: Array) -> "TorqueStatistics":
        """Returns the percept with one more sample's features, shape (num_features,)."""
        num_samples = self.num_samples + 1
        return TorqueStatistics(self.features + (features - self.features) / num_samples, num_samples)


class Inference(NamedTuple):
    """What a trial teaches.

    Attributes:
        posterior: Belief about the object and, in its memory, about all materials.
        log_evidence: Log probability (density) of the percept before it was felt, the size of its errors taken at the
            posterior mean as everywhere here; low means surprise.
        p_value: Probability of evidence as low as this, under what was believed.
    """

    posterior: ObjectBelief
    log_evidence: float
    p_value: float


def compute_posterior(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation_sd: float
) -> Inference:
    """Applies Bayes' rule to what was felt in a trial so far.

    Args:
        prior: Belief about the object before it was felt.
        statistics: What was felt.
        num_joints: Number of joints.
        noise: How well joints feel.
        deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].

    Returns: Posterior and evidence; before the first sample the prior itself, zero log evidence and no surprise.

    Raises:
        AffordanceError: The size of the errors finds no fixed point.
    """
    if statistics.num_samples == 0:
        return Inference(prior, 0.0, 1.0)
    likelihood = _find_likelihood(prior, statistics, num_joints, noise)
    densities = prior.densities
    memory = prior.memory.condition(likelihood, deviation_sd)
    posterior = ObjectBelief(memory, densities.condition(likelihood), prior.geometry)
    return Inference(posterior, densities.compute_log_evidence(likelihood), densities.compute_p_value(likelihood))


def _find_likelihood(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel
) -> Likelihood:
    rho = prior.densities.untruncated_mean
    for _ in range(_MAX_ITERATIONS):
        likelihood = noise.compute_likelihood(
            statistics.features, statistics.num_samples, num_joints, prior.geometry, rho
        )
        previous, rho = rho, prior.densities.condition(likelihood).untruncated_mean
        if np.abs(rho - previous).max() <= _TOLERANCE * np.abs(rho).max():
            return likelihood
    raise AffordanceError(
        f"the estimator found no fixed point in {_MAX_ITERATIONS} iterations; the last density changed by "
        f"{np.abs(rho - previous).max():.3g} kg/m^3"
    )
