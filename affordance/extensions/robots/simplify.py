"""Simplifies meshes of any quality, such as open or cracked meshes of many parts from CAD programs.

All vertices within a grid cell are merged into one, at the least-squares intersection of the planes of the adjacent
triangles (Lindstrom 2000, Out-of-core simplification of large polygonal models, SIGGRAPH). The grid is the finest
that respects the bound on triangles. No point moves by more than two cells, so all parts stay in place; edge collapse
would leave such meshes in pieces, or with many times the allowed number of triangles.
"""

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array

# Bounds of the cell width, as fractions of the mesh's diagonal, and number of bisections that determine it to 1 %.
# The coarsest grid has a single cell, and no triangle.
_FINEST, _COARSEST, _HALVINGS = 1.0 / 5000.0, 1.01, 11
# Singular values below this fraction of the largest are ignored; in those directions the vertex stays at the mean.
_LEAST_SINGULAR = 1e-2
# Largest number of cells along an axis that fits a 64-bit key.
_MOST_CELLS = 1 << 20

type _Indices = NDArray[np.intp]


def simplify(vertices: Array, faces: _Indices, most: int) -> tuple[Array, _Indices]:
    """Reduces a mesh to at most ``most`` triangles; a smaller mesh is returned unchanged.

    Vertices are (N, 3), [m], faces (M, 3).
    """
    if len(faces) <= most:
        return vertices, faces
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    finest, coarsest = _FINEST * diagonal, _COARSEST * diagonal
    cells, triangles = _cluster(vertices, faces, coarsest)
    for _ in range(_HALVINGS):
        width = float(np.sqrt(finest * coarsest))
        tried = _cluster(vertices, faces, width)
        if len(tried[1]) > most:
            finest = width
        else:
            coarsest, (cells, triangles) = width, tried
    used, kept = np.unique(triangles, return_inverse=True)
    return _place(vertices, faces, cells, coarsest)[used], kept.reshape(-1, 3)


def _cluster(vertices: Array, faces: _Indices, width: float) -> tuple[_Indices, _Indices]:
    """Assigns vertices to the cells of a grid of a given width, [m].

    Returns: Cell of each vertex, (N,), and the distinct triangles that span three cells, as their cells, (K, 3).
    """
    steps = np.minimum(((vertices - vertices.min(axis=0)) / width).astype(np.int64), _MOST_CELLS - 1)
    keys = (steps[:, 0] * _MOST_CELLS + steps[:, 1]) * _MOST_CELLS + steps[:, 2]
    cells = np.unique(keys, return_inverse=True)[1].ravel()
    between = cells[faces]
    apart = (between != np.roll(between, 1, axis=1)).all(axis=1)
    between = between[apart]
    ordered = np.sort(between, axis=1).astype(np.int64)
    count = int(cells.max()) + 1
    _, first = np.unique((ordered[:, 0] * count + ordered[:, 1]) * count + ordered[:, 2], return_index=True)
    return cells, between[np.sort(first)]


def _place(vertices: Array, faces: _Indices, cells: _Indices, width: float) -> Array:
    """Computes each cell's vertex: the point that is closest, in least squares, to all adjacent triangles' planes."""
    count = int(cells.max()) + 1
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals = np.divide(normals, areas[:, None], out=np.zeros_like(normals), where=areas[:, None] > 0.0)
    weights = areas + 1e-12 * (areas.max() or 1.0)  # the unweighted mean if all areas are zero
    owners, repeated = cells[faces].T.ravel(), np.tile(np.arange(len(faces)), 3)

    def add_up(values: Array) -> Array:
        """Sums values of triangle corners, (3 M, k), by cell, (count, k)."""
        return np.stack([np.bincount(owners, column, count) for column in values.T], axis=1)

    places, weight = vertices[faces].transpose(1, 0, 2).reshape(-1, 3), weights[repeated][:, None]
    mean = add_up(weight * places) / np.maximum(add_up(weight), np.finfo(float).tiny)
    n = normals[repeated]
    heights = np.einsum("ij,ij->i", n, corners[repeated, 0] - mean[owners])[:, None]
    A = add_up(weight * (n[:, :, None] * n[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    b = add_up(weight * heights * n)
    U, s, Vt = np.linalg.svd(A)
    inverse = np.divide(1.0, s, out=np.zeros_like(s), where=s > _LEAST_SINGULAR * s[:, :1])
    moved = np.einsum("nji,nj->ni", Vt, inverse * np.einsum("nji,nj->ni", U, b))
    placed: Array = mean + np.clip(moved, -width, width)
    return placed
