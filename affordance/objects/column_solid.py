"""Solids made of thin upright columns, as between a surface seen from above and one seen from below."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from affordance.arrays import Array, store_read_only
from affordance.objects.inertia import ArraySolid

# Column ends within this distance of the farthest along a direction are averaged: a single column's end is noise, two
# columns of half a millimetre are an end, [m].
_AS_FAR = 1e-3


@dataclass(frozen=True, eq=False)
class ColumnSolid(ArraySolid):
    """Solid of N square columns along Ez, given by read-only arrays.

    Places are the x and y of their axes, (N, 2), [m], areas those of their cross-sections, (N,), [m^2], and ends the
    least and largest z of each, (N, 2), [m].
    """

    places: Array
    areas: Array
    ends: Array

    def __post_init__(self) -> None:
        """Stores read-only copies; raises a ValueError for inconsistent shapes, or columns without volume."""
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
        """Lengths of the box around the columns' axes and ends along Ex, Ey, Ez, shape (3,), [m]."""
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
        return ends[reach >= reach.max() - _AS_FAR].mean(axis=0)
