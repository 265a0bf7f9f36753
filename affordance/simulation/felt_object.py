"""Knowledge from holding one object: about its own densities, and about its materials."""

from collections.abc import Sequence

from affordance.belief.density_belief import Prior
from affordance.belief.object_belief import FeltObject, Memory
from affordance.objects.colour import Colour
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
    recollection = memory.recall([part.appearance for part in parts], prior)
    colours: dict[int, Colour] = {}  # of the memory, by column: measured ones of one material differ
    for part, column in zip(parts, recollection.columns, strict=True):
        known, index = recollection.memory.recognise(part.colour, part.colour_sd, prior, part.lightness_sd)
        colours.setdefault(column, known.colours[index])
    posterior, likelihood = condition_on_torques(
        predict_object(parts, memory, prior), statistics, num_joints, noise, prior.deviation_sd
    )
    own = likelihood.select(list(colours))
    shared = own.marginalise_deviation(prior.deviation_sd)
    return posterior.memory, FeltObject(tuple(colours.values()), own, shared)
