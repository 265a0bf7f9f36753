"""Knowledge from holding one object: about its own densities, and about its materials."""

from collections.abc import Sequence

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.likelihood import Likelihood
from affordance.belief.object_belief import FeltObject, Memory
from affordance.proprioception.estimator import TorqueStatistics, condition_on_torques
from affordance.proprioception.torque_noise import NoiseModel
from affordance.vision.features import ComponentFeatures
from affordance.vision.systems import predict_object


def feel_object(
    parts: Sequence[ComponentFeatures],
    memory: Memory,
    statistics: TorqueStatistics,
    num_joints: int,
    noise: NoiseModel,
    prior: Prior,
) -> tuple[Memory, FeltObject]:
    """Learns from the torques felt of an object.

    Args:
        parts: Parts as they were seen.
        memory: Belief about materials before.
        statistics: Statistics of the measured torques.
        num_joints: Number of joints.
        noise: Errors of measured torques.
        prior: Prior of materials.

    Returns: Memory after the hold, and what the hold told, once for each colour.
    """
    columns = memory.recall([part.appearance for part in parts], prior).columns
    places = dict(zip((part.colour for part in parts), columns, strict=True))
    posterior, likelihood = condition_on_torques(
        predict_object(parts, memory, prior), statistics, num_joints, noise, prior.deviation_sd
    )
    chosen = list(places.values())
    own = Likelihood(likelihood.precision[np.ix_(chosen, chosen)], likelihood.information_vector[chosen], 0.0)
    return posterior.memory, FeltObject(tuple(places), own, own.marginalise_deviation(prior.deviation_sd))
