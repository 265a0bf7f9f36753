"""Inertial parameters of bodies composed of solids, as linear functions of the solids' densities.

The ten inertial parameters of a body, about a point To and expressed in T, are

    pi = [m, m p_ToTcm (3), Ixx, Iyy, Izz, Ixy, Ixz, Iyz]            [kg, kg m, kg m^2]

with Ixy the *product* of inertia -integral(x y dm), as in Drake. For a set of solid parts, pi(rho) = Phi rho, where
rho are the densities of its materials, and Phi depends on geometry only. Poses are homogeneous 4 x 4 matrices X_TE.
All transformations use the pseudo-inertia (Wensing, Kim & Slotine 2018)

    J = [[Sigma, m p], [m p^T, m]],    Sigma = integral(x x^T dm),    J_T = X_TE J_E X_TE^T
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from affordance.arrays import Array, store_read_only
from affordance.exceptions import BadArgumentError

NUM_PARAMETERS = 10
_NUM_AXES = 3
# Largest share of its volume that a sample of an uncertain shape may lose.
_MOST_LOST = 0.95
# Bounds of real densities, from aerogel to beyond osmium, [kg/m^3].
DENSITY_MIN, DENSITY_MAX = 0.1, 25_000.0


@runtime_checkable
class Shape(Protocol):
    """Hashable solid whose inertia at unit density is known. Only drawing code depends on its type."""

    def __hash__(self) -> int:
        return hash((type(self), self.sizes.tobytes()))

    @property
    def sizes(self) -> Array:
        """Visible lengths, shape (num_sizes,), [m]."""

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""

    def with_sizes(self, sizes: Array) -> "Shape":
        """Returns a solid of the same type with other sizes."""

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at a density of 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""

    def find_support(self, direction_E: Array) -> Array:
        """Finds the point of the solid that is farthest along a direction, from Eo in E, shape (3,), [m]."""

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the curvature radius at the support point, [m]; infinite if flat.

        The sphere of this radius has the Gaussian curvature of the surface.

        Edges, corners and the sides of cylinders count as flat, and so do triangles, even if they approximate a
        curved surface.
        """
        return np.inf


class Primitive(Shape):
    """Solid with inertia in closed form, centred at Eo and aligned with E. The fields of the class are its lengths.

    Lengths that are not finite and positive, or not three in a tuple, raise a BadArgumentError.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __post_init__(self) -> None:
        for each in fields(self):
            length = getattr(self, each.name)
            values = length if isinstance(length, tuple) else (length,)
            if not all(isinstance(value, int | float | np.number) and 0 < value < np.inf for value in values):
                problem = f"is {length}, must be finite and greater than 0"
                raise BadArgumentError(type(self).__name__, each.name, problem)
            if isinstance(length, tuple) and len(length) != _NUM_AXES:
                problem = f"holds {len(length)} lengths, must hold {_NUM_AXES}"
                raise BadArgumentError(type(self).__name__, each.name, problem)

    @classmethod
    def from_sizes(cls, sizes: Sequence[float] | Array) -> Self:
        """Builds the solid from its lengths, (num_sizes,), [m], in the order of the fields of the class.

        A wrong number of lengths raises a BadArgumentError.
        """
        kind: Any = cls
        lengths = tuple(float(size) for size in sizes)
        if (wanted := len(fields(cls))) not in (1, len(lengths)):
            raise BadArgumentError(cls.__name__, "", f"is given {len(lengths)} lengths, must be given {wanted}")
        solid: Self = kind(lengths) if len(fields(cls)) == 1 else kind(*lengths)
        return solid

    @property
    def sizes(self) -> Array:
        """Lengths in the order of the fields, shape (num_sizes,), [m]."""
        return np.hstack([getattr(self, each.name) for each in fields(self)])

    def with_sizes(self, sizes: Array) -> Self:
        """Returns a solid of the same type with other lengths, shape (num_sizes,), [m]."""
        return self.from_sizes(sizes)


@dataclass(frozen=True)
class Ellipsoid(Primitive):
    """Solid ellipsoid with semi-axes along Ex, Ey and Ez, [m]."""

    semi_axes: tuple[float, float, float]

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""
        return 4.0 / 3.0 * np.pi * float(np.prod(self.semi_axes))

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at 1 kg/m^3 about the centre: Sigma = m/5 diag(a^2, b^2, c^2), shape (4, 4)."""
        return self.volume * np.diag([*(self.sizes**2 / 5.0), 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """Finds the point whose outward normal is the direction: a^2 d / |a d|, for semi-axes a, shape (3,), [m]."""
        stretched = self.sizes * direction_E
        return self.sizes * stretched / np.linalg.norm(stretched)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the radius for semi-axes a, b, c and a unit vector d: a b c / |a d|^2, [m]."""
        return float(np.prod(self.sizes) / np.sum((self.sizes * direction_E) ** 2))


@dataclass(frozen=True, eq=False)
class LoadedShape(Shape):
    """Solid with another inertia than its visible shape.

    Some of its volume may count elsewhere, or its density may vary.

    Attributes:
        outside: Visible shape.
        J: Pseudo-inertia at a mean density of 1 kg/m^3 about Eo, expressed in E, shape (4, 4), read-only.
    """

    outside: Shape
    J: Array

    def __post_init__(self) -> None:
        """Stores a read-only copy."""
        store_read_only(self, J=np.array(self.J, dtype=float))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LoadedShape) and self.outside == other.outside and np.array_equal(self.J, other.J)

    def __hash__(self) -> int:
        return hash((self.outside, self.J.tobytes()))

    @property
    def sizes(self) -> Array:
        """Visible lengths, shape (num_sizes,), [m]."""
        return self.outside.sizes

    @property
    def volume(self) -> float:
        """Volume that counts, [m^3]."""
        return float(self.J[3, 3])

    def with_sizes(self, sizes: Array) -> "LoadedShape":
        """Returns the solid stretched along Ex, Ey, Ez to other visible lengths."""
        factors = sizes / self.sizes
        radius_and_length = 2
        stretch = factors[[0, 0, 1]] if len(factors) == radius_and_length else factors
        X = np.diag([*stretch, 1.0])
        return LoadedShape(self.outside.with_sizes(sizes), np.prod(stretch) * X @ self.J @ X)

    def unit_pseudo_inertia(self) -> Array:
        """Returns the pseudo-inertia at 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""
        return self.J.copy()

    def find_support(self, direction_E: Array) -> Array:
        """Finds the point of the visible shape that is farthest along a direction, shape (3,), [m]."""
        return self.outside.find_support(direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the radius of the visible shape's curvature, [m]."""
        return self.outside.compute_curvature_radius(direction_E)


def find_visible(shape: Shape) -> Shape:
    """Returns the visible shape of a solid, usually the solid itself."""
    return shape.outside if isinstance(shape, LoadedShape) else shape


def build_inertia_map(
    shapes: Sequence[Shape], poses_TE: Sequence[Array], material_indices: Sequence[int], num_materials: int
) -> Array:
    """Builds the matrix Phi that maps densities to inertial parameters (docs/model.md).

    Phi, (10, num_materials), [m^3, m^4, m^5], applies about To in T. Each solid part E of the tool has a pose X_TE,
    (4, 4), and the index of its density in rho. Materials without parts get a column of zeros.
    """
    Phi = np.zeros((NUM_PARAMETERS, num_materials))
    for shape, X_TE, index in zip(shapes, poses_TE, material_indices, strict=True):
        Phi[:, index] += parameters_from_pseudo_inertia(X_TE @ shape.unit_pseudo_inertia() @ X_TE.T)
    return Phi


@dataclass(frozen=True)
class Geometry:
    """Inertia map Phi of an object, (10, M), with its first-order uncertainty.

    Phi_errors, (G, 10, M), is the change of Phi by one standard deviation of each uncertain measurement.
    """

    Phi: Array
    Phi_errors: Array

    def compute_parameters(self, rho: Array, errors: Array) -> Array:
        """Computes parameters, (N, 10), from densities, (N, M), [kg/m^3], and errors, (N, G), in SD units."""
        parameters: Array = rho @ self.Phi.T
        for column in np.flatnonzero(self.Phi_errors.any(axis=(0, 1))):  # usually few of many materials
            # The change of the volume is a factor of all parameters, and what is left is the change of the form. To
            # first order this is their sum, but a large change of the volume moves no centre of mass.
            change, Phi = errors @ self.Phi_errors[:, :, column], self.Phi[:, column]
            change /= np.maximum(1.0, -change[:, [0]] / (_MOST_LOST * Phi[0]))
            grown = change[:, [0]] / Phi[0]
            parameters += rho[:, [column]] * ((1.0 + grown) * (Phi + change - grown * Phi) - Phi)
        return parameters

    def compute_covariance(self, rho: Array) -> Array:
        """Computes the covariance of pi, (10, 10), due to uncertain geometry, at densities rho, (M,)."""
        errors = self.Phi_errors @ rho  # (G, 10)
        return errors.T @ errors


def compute_point_parameters(p: Array) -> Array:
    """Computes the ten parameters, (..., 10), of unit point masses at p, (..., 3), [m]."""
    x, y, z = np.moveaxis(p, -1, 0)
    second = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    return np.stack([np.ones_like(x), x, y, z, *second], axis=-1)


def build_transform_map(X_GT: Array) -> Array:
    """Builds the map, (10, 10), from parameters about To in T to parameters about Go in G."""
    J = pseudo_inertia_from_parameters(np.eye(NUM_PARAMETERS))
    return np.column_stack([parameters_from_pseudo_inertia(X_GT @ unit @ X_GT.T) for unit in J])


def pseudo_inertia_from_parameters(pi: Array) -> Array:
    """Converts ten parameters, shape (..., 10), to pseudo-inertias, shape (..., 4, 4)."""
    Ixx, Iyy, Izz = (pi[..., i] for i in (4, 5, 6))
    J = np.empty((*pi.shape[:-1], 4, 4))
    J[..., 0, 0] = 0.5 * (Iyy + Izz - Ixx)
    J[..., 1, 1] = 0.5 * (Ixx + Izz - Iyy)
    J[..., 2, 2] = 0.5 * (Ixx + Iyy - Izz)
    J[..., 0, 1] = J[..., 1, 0] = -pi[..., 7]
    J[..., 0, 2] = J[..., 2, 0] = -pi[..., 8]
    J[..., 1, 2] = J[..., 2, 1] = -pi[..., 9]
    J[..., :3, 3] = J[..., 3, :3] = pi[..., 1:4]
    J[..., 3, 3] = pi[..., 0]
    return J


def parameters_from_pseudo_inertia(J: Array) -> Array:
    """Converts pseudo-inertias, shape (..., 4, 4), to the ten parameters pi, shape (..., 10)."""
    second = np.diagonal(J, axis1=-2, axis2=-1)[..., :3]
    moments = second.sum(axis=-1, keepdims=True) - second
    products = -J[..., [0, 0, 1], [1, 2, 2]]
    return np.concatenate([J[..., 3, 3, None], J[..., :3, 3], moments, products], axis=-1)


def spatial_inertia_from_parameters(pi: Array) -> SpatialInertia:
    """Converts the ten parameters to Drake's spatial inertia M_TTo_T.

    Physically impossible parameters raise a RuntimeError.
    """
    mass = float(pi[0])
    if mass == 0.0:
        return SpatialInertia.Zero()
    Gxx, Gyy, Gzz, Gxy, Gxz, Gyz = (float(value) / mass for value in pi[4:])
    return SpatialInertia(mass, pi[1:4] / mass, UnitInertia(Gxx, Gyy, Gzz, Gxy, Gxz, Gyz))


def parameters_from_spatial_inertia(M_TTo_T: SpatialInertia) -> Array:
    """Converts Drake's spatial inertia about To to the ten parameters, shape (10,)."""
    inertia = M_TTo_T.CalcRotationalInertia()
    return np.array([M_TTo_T.get_mass(), *M_TTo_T.CalcComMoment(), *inertia.get_moments(), *inertia.get_products()])
