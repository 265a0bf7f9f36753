"""Symmetry of a tool: two grips that differ only in where the materials are."""

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS, parameters_from_pseudo_inertia
from affordance.objects.tool import Tool

# Largest difference of moments per unit volume that counts as equal, [1, m, m^2].
_EQUAL = 1e-9


def is_symmetric(tool: Tool) -> bool:
    """Returns True if the two grips of a tool have the same shape, so that shape alone favours neither.

    With one prior for all materials, chance before any experience is then one half, for any task.
    """
    if len(tool.grips) != 2:
        return False
    one, other = (_describe_shape(held) for held in tool.list_gripped().values())
    return np.allclose(one, other, rtol=0.0, atol=_EQUAL)


def _describe_shape(held: Tool) -> Array:
    """Computes volumes of the parts and their moments about the grip per unit volume of the tool, (num_parts, 10)."""
    rows = np.array(
        [
            parameters_from_pseudo_inertia(part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T)
            for part in held.components
        ]
    ).reshape(-1, NUM_PARAMETERS)
    rows /= rows[:, 0].sum()
    return rows[np.lexsort(np.round(rows, 9).T[::-1])]
