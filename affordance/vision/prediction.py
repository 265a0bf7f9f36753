"""Predicts an object's inertia from visual features before it is held, p(lambda | v).

The colour of a component determines its material, and therefore the belief about its density. Sizes and poses
determine Phi, which maps densities to inertial parameters, and measurement errors determine the uncertainty of Phi to
first order. Frames: T the tool, E a component.
"""

from collections.abc import Sequence

import numpy as np
import scipy

from affordance.arrays import Array
from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.belief.object_belief import ObjectBelief
from affordance.objects.inertia import NUM_PARAMETERS, Geometry, build_inertia_map, parameters_from_pseudo_inertia
from affordance.vision.features import ComponentFeatures

# Step of central differences of Phi: relative for sizes, [m] for positions, [rad] for rotations.
_STEP = 1e-5


def predict_object(features: Sequence[ComponentFeatures], memory: MaterialMemory, prior: Prior) -> ObjectBelief:
    """Predicts an object's inertia from its visual features.

    Args:
        features: Features of each component.
        memory: Memory of materials. The memory in the resulting belief includes all colours of the object.
        prior: Prior for unknown materials.
    """
    recollection = memory.recall([part.appearance for part in features], prior)
    return ObjectBelief(
        recollection.memory,
        recollection.densities,
        measure_geometry(features, recollection.columns, recollection.densities.size),
        recollection.colours,
    )


def measure_geometry(
    features: Sequence[ComponentFeatures], material_indices: Sequence[int], num_materials: int
) -> Geometry:
    """Computes Phi, (10, num_materials), and its errors.

    Args:
        features: Features of each component.
        material_indices: Column of Phi for each component.
        num_materials: Number of materials.
    """
    Phi = build_inertia_map(
        [part.shape for part in features], [part.X_TE for part in features], material_indices, num_materials
    )
    changes: list[tuple[int, Array]] = []  # change of one column of Phi by one standard deviation of one error
    for part, index in zip(features, material_indices, strict=True):
        sds = [part.size_sd] * len(part.shape.sizes) + [part.position_sd] * 3 + [part.rotation_sd] * 3
        for measurement, sd in enumerate(sds):
            if sd > 0.0:
                displaced = (_displace(part, measurement, step) for step in (_STEP, -_STEP))
                plus, minus = (build_inertia_map([each.shape], [each.X_TE], [0], 1)[:, 0] for each in displaced)
                changes.append((index, sd * (plus - minus) / (2.0 * _STEP)))
        J = part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T
        for deformation in part.deformations:
            # First-order change of det(D) D J D^T at D = I + deformation. The factor det(D) accounts for the change
            # of mass, which is proportional to volume at a given density.
            change = deformation @ J + J @ deformation.T + np.trace(deformation) * J
            changes.append((index, parameters_from_pseudo_inertia(change)))
    errors = np.zeros((len(changes), NUM_PARAMETERS, num_materials))
    for error, (index, column) in zip(errors, changes, strict=True):
        error[:, index] = column
    return Geometry(Phi, errors)


def _displace(part: ComponentFeatures, measurement: int, step: float) -> ComponentFeatures:
    """Changes one measured feature by a small step, relative for sizes and absolute otherwise."""
    sizes = part.shape.sizes
    X_TE = np.array(part.X_TE)
    if measurement < len(sizes):
        sizes[measurement] *= 1.0 + step
    elif measurement < len(sizes) + 3:
        X_TE[measurement - len(sizes), 3] += step
    else:
        rotation = np.zeros(3)
        rotation[measurement - len(sizes) - 3] = step
        X_TE[:3, :3] = scipy.spatial.transform.Rotation.from_rotvec(rotation).as_matrix() @ X_TE[:3, :3]
    return ComponentFeatures(part.colour, part.shape.with_sizes(sizes), X_TE)
