"""Whether the two grips of a tool differ in nothing but which material is where."""

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import NUM_PARAMETERS, parameters_from_pseudo_inertia
from affordance.objects.tool import Tool

# Moments a unit volume that differ by less are equal, [1, m, m^2].
_EQUAL = 1e-9


def is_symmetric(tool: Tool) -> bool:
    """Says whether shape alone says nothing about which of two grips to take.

    Then, with one prior for all materials, chance before any experience is a half, whatever is asked of the tool.
    """
    if len(tool.grips) != 2:
        return False
    one, other = (_describe_shape(held) for held in tool.list_gripped().values())
    return np.allclose(one, other, rtol=0.0, atol=_EQUAL)


def _describe_shape(held: Tool) -> Array:
    """Volumes of the parts and their moments about the grip, over the tool's volume, sorted, (num_parts, 10)."""
    rows = np.array(
        [
            parameters_from_pseudo_inertia(part.X_TE @ part.shape.unit_pseudo_inertia() @ part.X_TE.T)
            for part in held.components
        ]
    ).reshape(-1, NUM_PARAMETERS)
    rows /= rows[:, 0].sum()
    return rows[np.lexsort(np.round(rows, 9).T[::-1])]
