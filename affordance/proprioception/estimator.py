"""The recursive Bayesian estimator of a held object's densities.

Within a trial it averages, sample by sample; the posterior at any time follows from the mean so far and the belief
the trial began with, so that the recursion is exact. Errors that grow with torque depend on the densities sought:
their size is evaluated at the posterior mean, iterated to a fixed point. The object's own deviation from its
materials' means is a nuisance: it is marginalised, so one odd object moves a material by what Bayes' rule says.
"""

from typing import NamedTuple

from affordance.arrays import Array
from affordance.belief.density_belief import DensityBelief
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import ObjectBelief
from affordance.objects.geometry import Geometry
from affordance.proprioception.fixed_point import find_fixed_point
from affordance.proprioception.torque_noise import NoiseModel


class TorqueStatistics(NamedTuple):
    """Sufficient statistics of the torques measured in a trial so far.

    Attributes:
        features: Running mean of the noise model's features, shape (num_features,).
        num_samples: How many samples went into it.
    """

    features: Array
    num_samples: int

    def add(self, features: Array) -> "TorqueStatistics":
        """Returns the statistics with one more sample's features, shape (num_features,)."""
        num_samples = self.num_samples + 1
        return TorqueStatistics(self.features + (features - self.features) / num_samples, num_samples)


class Inference(NamedTuple):
    """What a trial teaches.

    Attributes:
        posterior: Belief about the object and, in its memory, about all materials.
        log_evidence: Log probability density of the measurement before it was made, its errors taken at the
            posterior mean as everywhere here; low means surprise.
        p_value: Probability of evidence as low as this, under what was believed.
    """

    posterior: ObjectBelief
    log_evidence: float
    p_value: float


def compute_posterior(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation_sd: float
) -> Inference:
    """Applies Bayes' rule to the torques measured in a trial so far.

    Args:
        prior: Belief about the object before the trial.
        statistics: Of the measured torques.
        num_joints: Number of joints.
        noise: Errors of measured torques.
        deviation_sd: Standard deviation of an object's density about its material's mean, [kg/m^3].

    Returns: Posterior and evidence; before the first sample the prior itself, zero log evidence and no surprise.

    Raises:
        AffordanceError: The size of the errors finds no fixed point.
    """
    if statistics.num_samples == 0:
        return Inference(prior, 0.0, 1.0)
    posterior, likelihood = condition_on_torques(prior, statistics, num_joints, noise, deviation_sd)
    densities = prior.densities
    return Inference(posterior, densities.compute_log_evidence(likelihood), densities.compute_p_value(likelihood))


def condition_on_torques(
    prior: ObjectBelief, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel, deviation_sd: float
) -> tuple[ObjectBelief, Likelihood]:
    """The posterior alone, with the likelihood it comes from: without the evidence, which takes most of the time.

    Arguments and errors are those of compute_posterior; there must be a sample.
    """

    def find(belief: DensityBelief) -> Likelihood:
        return find_likelihood(belief, prior.geometry, statistics, num_joints, noise)

    lesson = prior.memory.learn(prior.densities, find, deviation_sd)
    return ObjectBelief(lesson.memory, lesson.densities, prior.geometry), lesson.likelihood


def find_likelihood(
    densities: DensityBelief, geometry: Geometry, statistics: TorqueStatistics, num_joints: int, noise: NoiseModel
) -> Likelihood:
    """Likelihood of what was felt, the size of errors taken at the mean it leads to believe.

    Args:
        densities: Belief about the object's densities before it was felt.
        geometry: Of the object.
        statistics: What was felt.
        num_joints: Number of joints.
        noise: How well joints feel.

    Raises:
        AffordanceError: The size of the errors finds no fixed point.
    """
    return find_fixed_point(
        densities,
        lambda rho: noise.compute_likelihood(statistics.features, statistics.num_samples, num_joints, geometry, rho),
    )
