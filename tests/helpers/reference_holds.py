"""Holds of the reference by quadrature (studies/exact_reference.py), as they are felt by a memory of materials."""

import numpy as np

from affordance.belief.density_belief import Prior
from affordance.belief.holds import Felt
from affordance.belief.material_memory import start_memory
from affordance.objects.appearance import PartAppearance
from studies.exact_reference import Model

MODEL = Model()
PRIOR = Prior(mode=MODEL.prior_mean, sd=MODEL.prior_sd, deviation=MODEL.scatter)


def colour(material):
    return 0.1 + 0.25 * material, 0.9 - 0.25 * material, 0.4


def look(number, materials):
    """The look of an object by its number: its length differs from that of all others."""
    length = 0.1 * (number + 1)
    return [PartAppearance(colour(i), (length, 0.02), (length * k, 0.0, 0.0)) for k, i in enumerate(materials)]


def feel(hold, model=MODEL):
    """What a hold of the reference tells, for one observer."""
    errors = None if hold.geometry is None else hold.geometry.transpose(2, 1, 0)[None]
    return Felt.from_torques(hold.y[None], hold.tau_arm, hold.A[None], (model.s0, model.w), 1, errors)


def hold_all(holds, owned, learner="density", memory=None):
    """The memory of an observer who felt these holds in this order."""
    memory = start_memory(learner) if memory is None else memory
    for hold in holds:
        recollection = memory.recall(look(hold.object, owned[hold.object]), PRIOR)
        memory = recollection.memory.learn(feel(hold), PRIOR.deviation).memory
    return memory
