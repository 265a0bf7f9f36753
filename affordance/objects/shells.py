"""Separates a mesh into bodies, and checks that each body has a closed surface.

CAD programs write the bodies of an assembly one after another into one mesh. If two bodies touch along an edge, four
faces meet there, and only the order of faces in the file shows which faces belong to the same body. A surface that is
wound inwards, inside another surface, is the wall of a cavity.
"""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from affordance.arrays import Array
from affordance.objects.array_solids import Faces, TriangleMesh, find_open_edges, integrate_faces

# Corners closer than this are merged, [m]. Rounding of single-precision coordinates in millimetres is 0.02 um.
_WELD = 1e-7
# Larger merging distance, used only if this closes the surface, [m]. No wall of a hand tool is that thin.
_WIDE_WELD = 1e-5


class MeshError(ValueError):
    """Error for a mesh whose faces do not enclose a solid."""


class Shell(NamedTuple):
    """Body of a mesh with its cavities. All surfaces are numbered in the file's order."""

    solid: TriangleMesh  # solid in the file's frame
    number: int  # number of its outer surface
    cavities: tuple[int, ...]  # numbers of the surfaces of its cavities
    faces: NDArray[np.intp]  # indices of its faces in the file, (k,)


class Shells(NamedTuple):
    """Bodies of a mesh in the file's order, and descriptions of the repairs that were necessary."""

    shells: tuple[Shell, ...]
    repairs: tuple[str, ...]


def find_shells(vertices: Array, faces: Faces) -> Shells:
    """Separates a mesh into its bodies. Duplicate vertices are merged.

    Args:
        vertices: Vertices, (n, 3), [m].
        faces: Indices of three vertices per face, (m, 3).

    Raises:
        MeshError: A surface is open, neighbouring faces have opposite windings, or a body has no volume.
    """
    repairs = []
    points, corner = weld(vertices)
    proper = find_proper_faces(corner[faces])
    if proper.any() and len(find_open_edges(corner[faces][proper])):
        wide_points, wide_corner = join_near(vertices)
        wide = find_proper_faces(wide_corner[faces])
        if wide.any() and not len(find_open_edges(wide_corner[faces][wide])):
            points, corner, proper = wide_points, wide_corner, wide
            repairs.append(f"was closed by joining corners less than {1e3 * _WIDE_WELD:g} mm apart")
    rows, faces = np.flatnonzero(proper), corner[faces]
    labels = split_faces(points, faces[rows])
    count = int(labels.max()) + 1
    bodies = [faces[rows[labels == number]] for number in range(count)]
    volumes = np.array([integrate_faces(points, body)[3, 3] for body in bodies])
    cavities: dict[int, list[int]] = {number: [] for number in range(count) if volumes[number] > 0.0}
    for number in np.flatnonzero(volumes <= 0.0).tolist():
        around = [k for k in cavities if contains(points, bodies[k], points[bodies[number][0]].mean(axis=0))]
        if around and -volumes[number] < min(volumes[k] for k in around):
            cavities[min(around, key=lambda k: float(volumes[k]))].append(number)
        elif volumes[number] < 0.0:
            bodies[number] = bodies[number][:, ::-1]
            cavities[number] = []
            repairs.append(f"shell {number} was wound inwards, and was reversed")
        else:
            raise MeshError(f"shell {number} bounds no volume")
    shells = []
    for number, inner in sorted(cavities.items()):
        parts = (number, *inner)
        surface = np.concatenate([bodies[k] for k in parts])
        used, index = np.unique(surface, return_inverse=True)
        solid = TriangleMesh(points[used], index.reshape(surface.shape))
        shells.append(Shell(solid, number, tuple(inner), rows[np.isin(labels, parts)]))
    return Shells(tuple(shells), tuple(repairs))


def weld(vertices: Array) -> tuple[Array, NDArray[np.intp]]:
    """Merges equal vertices.

    Returns:
        Distinct vertices, (k, 3), and the index of each original vertex among them, (n,).
    """
    _, first, index = np.unique(
        np.round(vertices / _WELD).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return vertices[first], index.ravel()


def join_near(vertices: Array) -> tuple[Array, NDArray[np.intp]]:
    """Merges vertices that are close together.

    Returns:
        Mean of each group of vertices, (k, 3), and the group of each original vertex, (n,).
    """
    pairs = scipy.spatial.cKDTree(vertices).query_pairs(_WIDE_WELD, output_type="ndarray")
    size = len(vertices)
    graph = scipy.sparse.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(size, size))
    count, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    joined = np.zeros((count, 3))
    np.add.at(joined, labels, vertices)
    return joined / np.bincount(labels, minlength=count)[:, None], labels.astype(np.intp)


def find_proper_faces(faces: Faces) -> NDArray[np.bool_]:
    """Finds the faces with three different vertices. Returns a mask, (m,)."""
    proper: NDArray[np.bool_] = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return proper


def split_faces(points: Array, faces: Faces) -> NDArray[np.intp]:
    """Assigns each face to a body, (m,). Bodies are numbered in the file's order.

    Args:
        points: Distinct vertices, (n, 3), [m].
        faces: Indices of three vertices per face, (m, 3).

    Raises:
        MeshError: There is no face, or an edge is not traversed equally often in both directions.
    """
    broken = find_open_edges(faces) if len(faces) else np.zeros((0, 2), dtype=np.intp)
    if len(broken) or not len(faces):
        if not len(faces):
            raise MeshError("has no face with an area")
        x, y, z = points[broken[0]].mean(axis=0)
        raise MeshError(
            f"has {len(broken)} edges that are open or between faces of opposite winding, the first near "
            f"({x:.4g}, {y:.4g}, {z:.4g}) m; a solid must be closed"
        )
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    face = np.tile(np.arange(len(faces)), 3)
    key = np.minimum(start, end) * np.int64(len(points)) + np.maximum(start, end)
    order = np.lexsort((face, start > end, key))
    key, face = key[order], face[order]
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    sizes = np.diff(begins, append=len(key))
    simple = begins[sizes == 2]
    one, other = [face[simple]], [face[simple + 1]]
    for begin, size in zip(begins[sizes > 2], sizes[sizes > 2], strict=True):
        there, back = face[begin : begin + size // 2], face[begin + size // 2 : begin + size]
        i, j = scipy.optimize.linear_sum_assignment(np.abs(there[:, None] - back))
        one.append(there[i])
        other.append(back[j])
    i, j = np.concatenate(one), np.concatenate(other)
    graph = scipy.sparse.coo_matrix((np.ones(len(i)), (i, j)), shape=(len(faces),) * 2)
    _, labels = scipy.sparse.csgraph.connected_components(graph, directed=False)
    # Labels are renumbered in the order of their first faces.
    _, first = np.unique(labels, return_index=True)
    rank = np.empty(len(first), dtype=np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[labels]


def contains(points: Array, faces: Faces, point: Array) -> bool:
    """Returns True if a point is inside a closed surface.

    The solid angle of the surface, as seen from the point, is 4 pi inside and 0 outside. Each face contributes omega
    with tan(omega / 2) = a . (b x c) / (|a||b||c| + (a . b)|c| + (b . c)|a| + (c . a)|b|) (Van Oosterom and Strackee
    1983, IEEE Transactions on Biomedical Engineering 30:125-126, from memory).
    """
    a, b, c = np.moveaxis(points[faces] - point, 1, 0)
    la, lb, lc = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    numerator = np.einsum("mi,mi->m", a, np.cross(b, c))
    products = [np.einsum("mi,mi->m", one, other) for one, other in ((a, b), (b, c), (c, a))]
    denominator = la * lb * lc + products[0] * lc + products[1] * la + products[2] * lb
    return bool(abs(2.0 * np.arctan2(numerator, denominator).sum()) > 2.0 * np.pi)
