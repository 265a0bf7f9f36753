"""Solids made of thin upright columns, as between a surface seen from above and one seen from below."""

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from affordance.arrays import Array

# Column ends within this distance of the farthest along a direction are averaged: a single column's end is noise, two
# columns of half a millimetre are an end, [m].
_AS_FAR = 1e-3


@dataclass(frozen=True, eq=False)
class ColumnSolid:
    """Solid of N square columns along Ez.

    Attributes:
        places: Positions of the columns' axes, x and y in E, shape (N, 2), read-only, [m].
        areas: Areas of the columns' cross-sections, shape (N,), read-only, [m^2].
        ends: Least and largest z of each column, shape (N, 2), read-only, [m].
    """

    places: Array
    areas: Array
    ends: Array

    def __post_init__(self) -> None:
        """Stores read-only copies.

        Raises:
            ValueError: There is no column, shapes are inconsistent, or the columns have no volume.
        """
        for name in ("places", "areas", "ends"):
            copy = np.array(getattr(self, name), dtype=float)
            copy.setflags(write=False)
            object.__setattr__(self, name, copy)
        count = len(self.areas)
        if not count or self.places.shape != (count, 2) or self.ends.shape != (count, 2):
            shapes = f"places are {self.places.shape}, areas {self.areas.shape} and ends {self.ends.shape}"
            raise ValueError(f"{shapes}, must be (N, 2), (N,) and (N, 2)")
        if not self.volume > 0.0:
            raise ValueError(f"the columns have a volume of {self.volume:g} m^3, must have more than 0")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ColumnSolid) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    @cached_property
    def _digest(self) -> bytes:
        content = hashlib.sha256(self.places.tobytes())
        content.update(self.areas.tobytes())
        content.update(self.ends.tobytes())
        return content.digest()

    @property
    def sizes(self) -> Array:
        """Lengths of the box around the columns' axes and ends along Ex, Ey, Ez, shape (3,), [m]."""
        across = np.ptp(self.places, axis=0) + np.sqrt(self.areas.max())
        return np.array([*across, self.ends[:, 1].max() - self.ends[:, 0].min()])

    @cached_property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(self.areas @ (self.ends[:, 1] - self.ends[:, 0]))

    def with_sizes(self, sizes: Array) -> "ColumnSolid":
        """Returns the solid stretched about Eo to a box of other lengths, shape (3,), [m]; itself if equal."""
        if np.array_equal(sizes, self.sizes):
            return self
        x, y, z = sizes / self.sizes
        return ColumnSolid(self.places * [x, y], self.areas * x * y, self.ends * z)

    def centre(self) -> tuple["ColumnSolid", Array]:
        """Returns the solid with Eo in its centroid, and the centroid's position before, shape (3,), [m]."""
        J = self.unit_pseudo_inertia()
        centroid = J[:3, 3] / J[3, 3]
        return ColumnSolid(self.places - centroid[:2], self.areas, self.ends - centroid[2]), centroid

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""
        return self._unit_pseudo_inertia.copy()

    @cached_property
    def _unit_pseudo_inertia(self) -> Array:
        low, high = self.ends.T
        # Volume, first and second moment of each column along z.
        volume, first, second = (self.areas * (high**k - low**k) / k for k in (1, 2, 3))
        J = np.zeros((4, 4))
        J[:2, :2] = (self.places * volume[:, None]).T @ self.places + np.eye(2) * (self.areas @ volume) / 12.0
        J[:2, 2] = J[2, :2] = first @ self.places
        J[:2, 3] = J[3, :2] = volume @ self.places
        J[2, 2], J[2, 3], J[3, 2], J[3, 3] = second.sum(), first.sum(), first.sum(), volume.sum()
        return J

    def find_support(self, direction_E: Array) -> Array:
        """Finds the mean of the columns' ends that are farthest along a direction, shape (3,), [m]."""
        ends = np.vstack([np.column_stack([self.places, z]) for z in self.ends.T])
        reach = ends @ (direction_E / np.linalg.norm(direction_E))
        support: Array = ends[reach >= reach.max() - _AS_FAR].mean(axis=0)
        return support

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Returns infinity, as the columns' ends are flat, [m]."""
        return np.inf
