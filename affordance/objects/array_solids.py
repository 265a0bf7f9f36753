"""Solids defined by arrays: triangle meshes, and sets of thin upright columns.

The inertia of a mesh is a sum of integrals over tetrahedra. Each face has corners p1, p2, p3, counter-clockwise as
seen from outside, and forms a tetrahedron with Eo. With d = p1 . (p2 x p3) / 6, the tetrahedron's signed volume, and
s = p1 + p2 + p3,

    integral x x^T dV = d (s s^T + sum_k p_k p_k^T) / 20,    integral x dV = d s / 4

The sums over all faces are the integrals over the solid, for any shape (Lien and Kajiya 1984, IEEE Computer Graphics
and Applications 4:35-42, from memory).
"""

import hashlib
from abc import abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from affordance.arrays import Array, store_read_only
from affordance.objects.inertia import Shape

type Faces = NDArray[np.intp]

# Corners within this distance of the farthest corner along a direction are on the same face, [m]. It exceeds the
# rounding of single-precision coordinates in millimetres, which is 0.02 um.
_SAME_FACE = 1e-6
# Column ends within this distance of the farthest end along a direction are averaged, because each end is noisy, [m].
# It equals the width of two columns of half a millimetre.
_AS_FAR = 1e-3


class ArraySolid(Shape):
    """Solid whose fields are arrays. Two solids are equal if their arrays are equal."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    @cached_property
    def _digest(self) -> bytes:
        return hashlib.sha256(b"".join(getattr(self, each.name).tobytes() for each in fields(self))).digest()

    @abstractmethod
    def _stretch(self, factors: Array) -> Self:
        """Stretches the solid about Eo along Ex, Ey and Ez by three factors."""

    @abstractmethod
    def _move(self, p: Array) -> Self:
        """Displaces the solid by p, shape (3,), [m]."""

    @cached_property
    @abstractmethod
    def _unit_pseudo_inertia(self) -> Array:
        """Pseudo-inertia at unit density, cached."""

    def with_sizes(self, sizes: Array) -> Self:
        """Stretches the solid about Eo until its bounding box has the given lengths, shape (3,), [m]."""
        return self if np.array_equal(sizes, self.sizes) else self._stretch(sizes / self.sizes)

    def centre(self) -> tuple[Self, Array]:
        """Moves Eo to the centroid of the solid.

        Returns:
            The moved solid, and the previous position of the centroid, (3,), [m].
        """
        J = self._unit_pseudo_inertia
        centroid = J[:3, 3] / J[3, 3]
        return self._move(-centroid), centroid

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""
        return self._unit_pseudo_inertia.copy()


@dataclass(frozen=True, eq=False)
class TriangleMesh(ArraySolid):
    """Solid bounded by closed triangular surfaces. A surface that is wound inwards bounds a cavity.

    Attributes:
        vertices: Vertices in E, (n, 3), [m], read-only.
        faces: Indices of three vertices per face, (m, 3), counter-clockwise as seen from outside the material,
            read-only.
    """

    vertices: Array
    faces: Faces

    def __post_init__(self) -> None:
        """Stores read-only copies of the arrays.

        Raises:
            ValueError: The arrays are invalid, a surface is open, or the volume is not positive.
        """
        vertices, faces = np.array(self.vertices, dtype=float), np.array(self.faces, dtype=np.intp)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            shapes = f"vertices are {vertices.shape} and faces {faces.shape}"
            raise ValueError(f"{shapes}, must be (n, 3) and (m, 3) with at least one face")
        if not np.isfinite(vertices).all():
            raise ValueError("vertices are not all finite")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise ValueError(f"faces refer to corners {faces.min()} to {faces.max()}, but there are {len(vertices)}")
        open_edges = find_open_edges(faces)
        if len(open_edges):
            raise ValueError(f"the surface has {len(open_edges)} open edges, must be closed and consistently wound")
        store_read_only(self, vertices=vertices, faces=faces)
        if not self.volume > 0.0:
            raise ValueError(f"the faces bound a volume of {self.volume:g} m^3, must be wound to bound more than 0")

    @property
    def sizes(self) -> Array:
        """Lengths of the bounding box along Ex, Ey, Ez, shape (3,), [m]."""
        return np.ptp(self._hull_corners, axis=0)

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(self._unit_pseudo_inertia[3, 3])

    def _stretch(self, factors: Array) -> "TriangleMesh":
        return TriangleMesh(self.vertices * factors, self.faces)

    def _move(self, p: Array) -> "TriangleMesh":
        return TriangleMesh(self.vertices + p, self.faces)

    def find_support(self, direction_E: Array) -> Array:
        """Computes the mean of the corners that are farthest along a direction, shape (3,), [m]."""
        reach = self._hull_corners @ (direction_E / np.linalg.norm(direction_E))
        return self._hull_corners[reach >= reach.max() - _SAME_FACE].mean(axis=0)

    @cached_property
    def _hull_corners(self) -> Array:
        """Distinct vertices that belong to a face, (n, 3), [m]."""
        return np.unique(self.vertices[np.unique(self.faces)], axis=0)

    @cached_property
    def _unit_pseudo_inertia(self) -> Array:
        return integrate_faces(self.vertices, self.faces)


@dataclass(frozen=True, eq=False)
class ColumnSolid(ArraySolid):
    """Solid composed of N square columns along Ez.

    Attributes:
        places: Coordinates x and y of the columns' axes, (N, 2), [m], read-only.
        areas: Cross-sections of the columns, (N,), [m^2], read-only.
        ends: Least and largest z of each column, (N, 2), [m], read-only.
    """

    places: Array
    areas: Array
    ends: Array

    def __post_init__(self) -> None:
        """Stores read-only copies of the arrays.

        Raises:
            ValueError: The arrays have inconsistent shapes, or the columns have no volume.
        """
        arrays = {name: np.array(getattr(self, name), dtype=float) for name in ("places", "areas", "ends")}
        store_read_only(self, **arrays)
        count = len(self.areas)
        if not count or self.places.shape != (count, 2) or self.ends.shape != (count, 2):
            shapes = f"places are {self.places.shape}, areas {self.areas.shape} and ends {self.ends.shape}"
            raise ValueError(f"{shapes}, must be (N, 2), (N,) and (N, 2)")
        if not self.volume > 0.0:
            raise ValueError(f"the columns have a volume of {self.volume:g} m^3, must have more than 0")

    @property
    def sizes(self) -> Array:
        """Lengths of a box around all columns along Ex, Ey and Ez, shape (3,), [m]."""
        across = np.ptp(self.places, axis=0) + np.sqrt(self.areas.max())
        return np.array([*across, self.ends[:, 1].max() - self.ends[:, 0].min()])

    @cached_property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(self.areas @ (self.ends[:, 1] - self.ends[:, 0]))

    def _stretch(self, factors: Array) -> "ColumnSolid":
        x, y, z = factors
        return ColumnSolid(self.places * [x, y], self.areas * x * y, self.ends * z)

    def _move(self, p: Array) -> "ColumnSolid":
        return ColumnSolid(self.places + p[:2], self.areas, self.ends + p[2])

    @cached_property
    def _unit_pseudo_inertia(self) -> Array:
        low, high = self.ends.T
        # Volume, and first and second moments about Eo along z, of each column.
        volume, first, second = (self.areas * (high**k - low**k) / k for k in (1, 2, 3))
        J = np.zeros((4, 4))
        J[:2, :2] = (self.places * volume[:, None]).T @ self.places + np.eye(2) * (self.areas @ volume) / 12.0
        J[:2, 2] = J[2, :2] = first @ self.places
        J[:2, 3] = J[3, :2] = volume @ self.places
        J[2, 2], J[2, 3], J[3, 2], J[3, 3] = second.sum(), first.sum(), first.sum(), volume.sum()
        return J

    def find_support(self, direction_E: Array) -> Array:
        """Computes the mean of the column ends that are farthest along a direction, shape (3,), [m]."""
        ends = np.vstack([np.column_stack([self.places, z]) for z in self.ends.T])
        reach = ends @ (direction_E / np.linalg.norm(direction_E))
        return ends[reach >= reach.max() - _AS_FAR].mean(axis=0)


def integrate_faces(vertices: Array, faces: Faces) -> Array:
    """Computes the pseudo-inertia, (4, 4), of a closed volume at 1 kg/m^3 about the origin.

    Args:
        vertices: Vertices, (n, 3), [m].
        faces: Indices of three vertices per face, (m, 3). Surfaces that are wound inwards have negative volume.
    """
    # Integrating about the mean of the corners reduces rounding errors.
    middle = vertices[faces[:, 0]].mean(axis=0)
    corners = vertices[faces] - middle  # (m, 3, 3)
    d = np.einsum("mi,mi->m", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    s = corners.sum(axis=1)
    J = np.zeros((4, 4))
    J[:3, :3] = (np.einsum("m,mi,mj->ij", d, s, s) + np.einsum("m,mki,mkj->ij", d, corners, corners)) / 20.0
    J[:3, 3] = J[3, :3] = d @ s / 4.0
    J[3, 3] = d.sum()
    X = np.eye(4)
    X[:3, 3] = middle
    return X @ J @ X.T


def find_open_edges(faces: Faces) -> NDArray[np.intp]:
    """Finds the edges that the faces, (m, 3), do not traverse equally often in both directions.

    Returns:
        Pairs of vertex indices, (k, 2).
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    proper = start != end
    start, end = start[proper], end[proper]
    span = np.int64(faces.max()) + 1
    keys, index = np.unique(np.minimum(start, end) * span + np.maximum(start, end), return_inverse=True)
    balance = np.bincount(index, weights=np.where(start < end, 1.0, -1.0), minlength=len(keys))
    broken = keys[balance != 0.0]
    return np.column_stack([broken // span, broken % span]).astype(np.intp)
