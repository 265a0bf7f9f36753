"""Two objects to be seen and held: one of one material, one of two, end to end."""

import numpy as np

from affordance.belief.density_belief import DensityBelief
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.objects.inertia import Ellipsoid
from affordance.vision.features import ComponentFeatures
from affordance.vision.prediction import predict_object

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


def detect_parts(features, prior, memory=None) -> ObjectBelief:
    return predict_object(features, memory or MaterialMemory(), prior)


def know(config, density=8500.0, precision=1e-2) -> MaterialMemory:
    """Memory of the first material of an experiment, with a density and a precision."""
    return MaterialMemory.from_belief(
        config.colours[:1], DensityBelief(np.array([[precision]]), np.array([precision * density]))
    )
