"""Solids with closed-form inertia: boxes, cylinders and capsules, each centred at Eo and aligned with E.

As in Drake, the axes of cylinders and capsules are along Ez, and a capsule's length excludes its hemispheres.
"""

from dataclasses import dataclass

import numpy as np

from affordance.arrays import Array
from affordance.objects.inertia import Primitive

# Direction components below this fraction are treated as rounding errors. Otherwise the support point of a flat face
# would jump to one of its corners.
_ALONG = 1e-9


@dataclass(frozen=True)
class Box(Primitive):
    """Solid box with edges along Ex, Ey and Ez."""

    lengths: tuple[float, float, float]

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.prod(self.lengths))

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about the centre, (4, 4). Sigma = m/12 diag(a^2, b^2, c^2)."""
        return self.volume * np.diag([*(self.sizes**2 / 12.0), 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """Finds the middle of the face, edge or corner that is farthest along a direction, (3,), [m]."""
        return 0.5 * self.sizes * _take_signs(direction_E)


@dataclass(frozen=True)
class _Round(Primitive):
    radius: float
    length: float


@dataclass(frozen=True)
class Cylinder(_Round):
    """Solid cylinder along Ez with a radius and a length, [m]."""

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.pi * self.radius**2 * self.length)

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about the centre, (4, 4). Sigma = m diag(r^2/4, r^2/4, l^2/12)."""
        across = self.radius**2 / 4.0
        return self.volume * np.diag([across, across, self.length**2 / 12.0, 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """Finds the point, or the middle of the face or line, that is farthest along a direction, (3,), [m]."""
        across = np.array([direction_E[0], direction_E[1], 0.0])
        distance = float(np.linalg.norm(across))
        end = _point_along(0.5 * self.length, direction_E)
        return end + (self.radius * across / distance if distance > _ALONG * np.linalg.norm(direction_E) else 0.0)


@dataclass(frozen=True)
class Capsule(_Round):
    """Solid cylinder along Ez with hemispheres on its ends. Its length, [m], excludes the hemispheres."""

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius))

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about the centre, shape (4, 4).

        The centroid of each hemisphere is 3/8 r beyond the end of the cylinder; the mean square of z from this end is
        r^2/5.
        """
        r, half = self.radius, 0.5 * self.length
        middle, ends = np.pi * r**2 * self.length, 4.0 / 3.0 * np.pi * r**3
        across = middle * r**2 / 4.0 + ends * r**2 / 5.0
        along = middle * half**2 / 3.0 + ends * (half**2 + 0.75 * half * r + r**2 / 5.0)
        return np.diag([across, across, along, middle + ends])

    def find_support(self, direction_E: Array) -> Array:
        """Finds the point, or the middle of the line, that is farthest along a direction, (3,), [m]."""
        ball: Array = self.radius * direction_E / np.linalg.norm(direction_E)
        return ball + _point_along(0.5 * self.length, direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Returns the radius of the hemispheres, [m]; infinite on the side, which is flat in one direction."""
        return self.radius if _take_signs(direction_E)[2] else np.inf


def _take_signs(direction_E: Array) -> Array:
    """Computes the signs of a direction's components, (3,). Rounding errors count as 0."""
    return np.sign(direction_E) * (np.abs(direction_E) > _ALONG * np.linalg.norm(direction_E))


def _point_along(half: float, direction_E: Array) -> Array:
    return np.array([0.0, 0.0, half * _take_signs(direction_E)[2]])
