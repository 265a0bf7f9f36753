"""Visual prior p(lambda | v): the belief about an object's inertia before it is held, from its visual features.

The colour of each component selects its material and with it the belief about its density; sizes and pose give Phi,
with its uncertainty to first order. Frames: T the tool, E a component.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from affordance.belief.density_belief import Prior
from affordance.belief.object_belief import Memory, ObjectBelief
from affordance.objects.inertia import NUM_PARAMETERS, Geometry, build_inertia_map, parameters_from_pseudo_inertia
from affordance.vision.features import ComponentFeatures

# Step of the central differences of Phi: relative for sizes, in metres for positions, in radians for rotations.
_STEP = 1e-5


def predict_object(features: Sequence[ComponentFeatures], memory: Memory, prior: Prior) -> ObjectBelief:
    """Predicts an object's inertia from its visual features.

    Args:
        features: Features of each component.
        memory: Belief about the materials and objects met before.
        prior: Belief about materials never met.

    Returns: Belief about the object before it is held; its memory includes every colour of the object.
    """
    recollection = memory.recall([part.appearance for part in features], prior)
    return ObjectBelief(
        recollection.memory,
        recollection.densities,
        measure_geometry(features, recollection.columns, recollection.densities.size),
    )


def measure_geometry(
    features: Sequence[ComponentFeatures], material_indices: Sequence[int], num_materials: int
) -> Geometry:
    """Computes Phi, (10, num_materials), and its errors; material_indices gives the column of each component."""
    Phi = build_inertia_map(
        [part.shape for part in features], [part.X_TE for part in features], material_indices, num_materials
    )
    errors = []
    for part, index in zip(features, material_indices, strict=True):
        for measurement, sd in enumerate(_list_errors(part)):
            if sd > 0.0:
                error = np.zeros((NUM_PARAMETERS, num_materials))
                plus, minus = (_displace(part, measurement, step) for step in (_STEP, -_STEP))
                difference = build_inertia_map([plus.shape], [plus.X_TE], [0], 1) - build_inertia_map(
                    [minus.shape], [minus.X_TE], [0], 1
                )
                error[:, index] = sd * difference[:, 0] / (2.0 * _STEP)
                errors.append(error)
        J = part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T
        for deformation in part.deformations:
            error = np.zeros((NUM_PARAMETERS, num_materials))
            # First-order change of det(D) D J D^T at D = I + deformation: a larger solid of given density has more
            # mass.
            change = deformation @ J + J @ deformation.T + np.trace(deformation) * J
            error[:, index] = parameters_from_pseudo_inertia(change)
            errors.append(error)
    return Geometry(Phi, np.array(errors).reshape(-1, NUM_PARAMETERS, num_materials))


def _list_errors(part: ComponentFeatures) -> list[float]:
    """Lists the standard deviations of a component's measurements: sizes, position, rotation."""
    return [part.size_sd] * len(part.shape.sizes) + [part.position_sd] * 3 + [part.rotation_sd] * 3


def _displace(part: ComponentFeatures, measurement: int, step: float) -> ComponentFeatures:
    """Returns the features with one measurement displaced by a step (sizes: by that fraction)."""
    sizes = part.shape.sizes
    X_TE = np.array(part.X_TE)
    if measurement < len(sizes):
        sizes[measurement] *= 1.0 + step
    elif measurement < len(sizes) + 3:
        X_TE[measurement - len(sizes), 3] += step
    else:
        rotation = np.zeros(3)
        rotation[measurement - len(sizes) - 3] = step
        X_TE[:3, :3] = Rotation.from_rotvec(rotation).as_matrix() @ X_TE[:3, :3]
    return ComponentFeatures(part.colour, part.shape.with_sizes(sizes), X_TE)
