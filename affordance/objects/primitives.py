"""Solids with a formula: boxes, cylinders and capsules, each centred at Eo with its axes along those of E.

As in Drake, cylinders and capsules stand along Ez, and a capsule's length is that of its straight middle.
"""

from dataclasses import dataclass

import numpy as np

from affordance.arguments import check_lengths
from affordance.arrays import Array

# A direction component that is smaller than this, of a unit vector, is rounding: without this the support point of a
# flat face would jump to one of its corners.
_ALONG = 1e-9


@dataclass(frozen=True)
class Box:
    """A solid box.

    Attributes:
        lengths: Of its edges along Ex, Ey, Ez, [m].
    """

    lengths: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuses impossible boxes.

        Raises:
            BadArgumentError: A length is not finite and positive.
        """
        check_lengths(type(self).__name__, lengths=self.lengths)

    @property
    def sizes(self) -> Array:
        """The three lengths, shape (3,), [m]."""
        return np.array(self.lengths)

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.prod(self.lengths))

    def with_sizes(self, sizes: Array) -> "Box":
        """Returns the box with other lengths, shape (3,), [m]."""
        a, b, c = (float(size) for size in sizes)
        return Box((a, b, c))

    def unit_pseudo_inertia(self) -> Array:
        """Pseudo-inertia at 1 kg/m^3 about the centre: Sigma = m/12 diag(a^2, b^2, c^2), shape (4, 4)."""
        return self.volume * np.diag([*(self.sizes**2 / 12.0), 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """The middle of the face, edge or corner that lies farthest along a direction, shape (3,), [m]."""
        return 0.5 * self.sizes * _take_signs(direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Infinite, as the faces are flat; an edge or a corner is taken for flat, too."""
        return np.inf


@dataclass(frozen=True)
class Cylinder:
    """A solid cylinder along Ez.

    Attributes:
        radius: [m].
        length: [m].
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        """Refuses impossible cylinders.

        Raises:
            BadArgumentError: Radius or length is not finite and positive.
        """
        check_lengths(type(self).__name__, radius=(self.radius,), length=(self.length,))

    @property
    def sizes(self) -> Array:
        """Radius and length, shape (2,), [m]."""
        return np.array([self.radius, self.length])

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.pi * self.radius**2 * self.length)

    def with_sizes(self, sizes: Array) -> "Cylinder":
        """Returns the cylinder with another radius and length, shape (2,), [m]."""
        return Cylinder(float(sizes[0]), float(sizes[1]))

    def unit_pseudo_inertia(self) -> Array:
        """Pseudo-inertia at 1 kg/m^3 about the centre: Sigma = m diag(r^2/4, r^2/4, l^2/12), shape (4, 4)."""
        across = self.radius**2 / 4.0
        return self.volume * np.diag([across, across, self.length**2 / 12.0, 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """The point of the surface, or middle of the face or line, farthest along a direction, shape (3,), [m]."""
        return _point_across(self.radius, direction_E) + _point_along(0.5 * self.length, direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Infinite: the ends are flat, and the side is along its axis; a rim is taken for flat, too."""
        return np.inf


@dataclass(frozen=True)
class Capsule:
    """A solid cylinder along Ez with a half ball on each end.

    Attributes:
        radius: [m].
        length: Of the cylinder, without the half balls, [m].
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        """Refuses impossible capsules.

        Raises:
            BadArgumentError: Radius or length is not finite and positive.
        """
        check_lengths(type(self).__name__, radius=(self.radius,), length=(self.length,))

    @property
    def sizes(self) -> Array:
        """Radius and length, shape (2,), [m]."""
        return np.array([self.radius, self.length])

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return float(np.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius))

    def with_sizes(self, sizes: Array) -> "Capsule":
        """Returns the capsule with another radius and length, shape (2,), [m]."""
        return Capsule(float(sizes[0]), float(sizes[1]))

    def unit_pseudo_inertia(self) -> Array:
        """Pseudo-inertia at 1 kg/m^3 about the centre, shape (4, 4).

        The half balls' centroids lie 3/8 r beyond the cylinder's ends; their mean square of z from there is r^2/5.
        """
        r, half = self.radius, 0.5 * self.length
        middle, ends = np.pi * r**2 * self.length, 4.0 / 3.0 * np.pi * r**3
        across = middle * r**2 / 4.0 + ends * r**2 / 5.0
        along = middle * half**2 / 3.0 + ends * (half**2 + 0.75 * half * r + r**2 / 5.0)
        return np.diag([across, across, along, middle + ends])

    def find_support(self, direction_E: Array) -> Array:
        """The point of the surface, or middle of a line of it, that lies farthest along a direction, (3,), [m]."""
        ball: Array = self.radius * direction_E / np.linalg.norm(direction_E)
        return ball + _point_along(0.5 * self.length, direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """The radius on the half balls; infinite on the side, which is flat along its axis, [m]."""
        return self.radius if _take_signs(direction_E)[2] else np.inf


def _take_signs(direction_E: Array) -> Array:
    """Signs of the components of a direction, 0 where one is nothing but rounding, (3,)."""
    signs: Array = np.sign(direction_E) * (np.abs(direction_E) > _ALONG * np.linalg.norm(direction_E))
    return signs


def _point_along(half: float, direction_E: Array) -> Array:
    return np.array([0.0, 0.0, half * _take_signs(direction_E)[2]])


def _point_across(radius: float, direction_E: Array) -> Array:
    across = np.array([direction_E[0], direction_E[1], 0.0])
    length = float(np.linalg.norm(across))
    return radius * across / length if length > _ALONG * np.linalg.norm(direction_E) else np.zeros(3)
