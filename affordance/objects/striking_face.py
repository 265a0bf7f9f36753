"""Striking faces of tools, and the tool parts to which they belong.

Frames: T the tool, E the part, Q the middle of the face.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array, store_read_only
from affordance.objects.inertia import Shape

# Largest distance by which a part may extend beyond the plane of a striking face, because coordinates are rounded,
# [m].
PLANE_TOLERANCE = 2e-4
# Number of directions, 5 degrees apart, in which a part's convex hull is compared with a point.
_NUM_DIRECTIONS = 1600


@dataclass(frozen=True, eq=False)
class StrikingFace:
    """Striking face of a part.

    Attributes:
        name: Name of the face.
        p_EQ: Middle of the face, (3,), [m], read-only.
        normal_E: Outward unit normal, (3,), read-only.
    """

    name: str
    p_EQ: Array
    normal_E: Array

    def __post_init__(self) -> None:
        """Stores read-only copies."""
        store_read_only(self, p_EQ=np.array(self.p_EQ, dtype=float), normal_E=np.array(self.normal_E, dtype=float))

    def express(self, X_TE: Array) -> tuple[Array, Array]:
        """Computes the middle p_TQ and the normal in T, from the part's pose X_TE, shape (4, 4)."""
        return X_TE[:3, :3] @ self.p_EQ + X_TE[:3, 3], X_TE[:3, :3] @ self.normal_E


def find_struck_part(parts: Sequence[tuple[Shape, Array]], p_TQ: Array, normal_T: Array) -> tuple[int, float]:
    """Finds the part whose convex hull has a face at a given point, so that the part can strike there.

    The hull has a support function h(d), the largest d . x over its points x, for each unit vector d. A point p is on
    a face with normal n if h(n) = n . p, and d . p <= h(d) for all d.

    Args:
        parts: Solids and their poses X_TE, (4, 4).
        p_TQ: Point of the face, (3,), [m].
        normal_T: Outward unit normal of the face, (3,).

    Returns:
        Index of the part, and the distance between the point and the part's face, [m].
    """
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_NUM_DIRECTIONS)
    z = 1.0 - (2.0 * np.arange(_NUM_DIRECTIONS) + 1.0) / _NUM_DIRECTIONS
    across = np.sqrt(1.0 - z**2)
    directions = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
    gaps = np.full(len(parts), np.inf)
    behind = [_measure_behind(shape, X_TE, p_TQ, normal_T) for shape, X_TE in parts]
    for index in np.argsort(behind):
        if behind[index] >= gaps.min():
            break  # parts further behind cannot have a smaller gap
        shape, X_TE = parts[index]
        p_EQ = X_TE[:3, :3].T @ (p_TQ - X_TE[:3, 3])
        gaps[index] = max(behind[index], *(float(d @ (p_EQ - shape.find_support(d))) for d in directions))
    best = int(np.argmin(gaps))
    return best, float(gaps[best])


def _measure_behind(shape: Shape, X_TE: Array, p_TQ: Array, normal_T: Array) -> float:
    """Computes the distance along a normal from a point to the end of a part, [m]."""
    R_TE = X_TE[:3, :3]
    p_EQ, normal_E = R_TE.T @ (p_TQ - X_TE[:3, 3]), R_TE.T @ normal_T
    return abs(float(normal_E @ (shape.find_support(normal_E) - p_EQ)))
