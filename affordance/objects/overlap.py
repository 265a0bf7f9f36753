"""Fraction of a tool's volume that is counted twice, where mesh bodies intersect."""

import itertools
from collections.abc import Sequence

import manifold3d
import numpy as np

from affordance.objects.triangle_mesh import TriangleMesh

# Metres to millimetres, for which manifold3d's tolerances are made.
_SCALE = 1e3


def compute_overlap(solids: Sequence[TriangleMesh]) -> float:
    """Computes the volume that pairs of solids share, as a fraction of the sum of their volumes.

    Args:
        solids: Solids in one common frame.

    Returns: Fraction; NaN if a surface intersects itself, so that it does not bound a single body.
    """
    bodies = [_convert(solid) for solid in solids]
    if any(body.status() != manifold3d.Error.NoError for body in bodies):
        return float("nan")
    shared = 0.0
    for one, other in itertools.combinations(bodies, 2):
        (low, high), (other_low, other_high) = (np.reshape(body.bounding_box(), (2, 3)) for body in (one, other))
        if (np.maximum(low, other_low) < np.minimum(high, other_high)).all():
            shared += (one ^ other).volume()
    return float(shared / sum(body.volume() for body in bodies))


def _convert(solid: TriangleMesh) -> manifold3d.Manifold:
    vertices = np.ascontiguousarray(_SCALE * solid.vertices)
    return manifold3d.Manifold(manifold3d.Mesh64(vertices, np.ascontiguousarray(solid.faces.astype(np.uint64))))
