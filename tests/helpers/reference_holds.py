"""Holds of the reference by quadrature (studies/exact_reference.py), as they are felt by a memory of materials."""

import numpy as np

from affordance.belief.density_belief import DensityBelief, Prior, summarise_density
from affordance.belief.holds import Felt
from affordance.belief.learner import Seen
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


def feel(*holds, model=MODEL):
    """What holds of the reference tell, one for each observer."""
    y, arm, A = (np.stack([getattr(hold, name) for hold in holds]) for name in ("y", "tau_arm", "A"))
    errors = None if holds[0].geometry is None else np.stack([h.geometry.transpose(2, 1, 0) for h in holds])
    return Felt.from_torques(y, arm, A, (model.s0, model.w), 1, errors)


def hold_all(holds, owned, learner="density", memory=None):
    """The memory of an observer who felt these holds in this order."""
    memory = start_memory(learner) if memory is None else memory
    for hold in holds:
        recollection = memory.recall(look(hold.object, owned[hold.object]), PRIOR)
        memory = recollection.memory.learn(feel(hold), PRIOR.deviation).memory
    return memory


def summarise(memory, owned):
    """Beliefs of a memory with one density a colour about materials, and about objects by (object, material)."""
    mu = {i: memory.density(colour(i)) for i in {i for own in owned for i in own} if colour(i) in memory.colours}
    rho = {}
    for number, thing in enumerate(memory.things):
        k = next(k for k, own in enumerate(owned) if tuple(look(k, own)) == thing.appearance)
        own = memory.learner.infer(memory.state, Seen(thing.colours, np.array([number])))[1].own
        belief = DensityBelief.from_normals(own.select(range(len(owned[k]))))
        rho |= {(k, i): summarise_density(belief, j) for j, i in enumerate(owned[k])}
    return mu, rho
