"""Two objects to be seen and held: one of one material, one of two, end to end."""

import numpy as np

from affordance.inertia import Ellipsoid
from affordance.memory import MaterialMemory
from affordance.object_belief import ObjectBelief
from affordance.visual_prior import ComponentFeatures, predict_object

RED, BLUE = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9)


def place(x):
    X_TE = np.eye(4)
    X_TE[0, 3] = x
    return X_TE


ONE_MATERIAL = (ComponentFeatures(RED, Ellipsoid((0.1, 0.02, 0.02)), place(0.1)),)
TWO_MATERIALS = (
    ComponentFeatures(RED, Ellipsoid((0.05, 0.025, 0.025)), place(0.05)),
    ComponentFeatures(BLUE, Ellipsoid((0.06, 0.02, 0.02)), place(0.16)),
)


def see(features, prior, memory=None) -> ObjectBelief:
    return predict_object(features, memory or MaterialMemory(), prior)
