"""Inertial parameters of bodies made of several solids, as linear functions of the solids' densities.

The ten inertial parameters of a body, about a point To and expressed in T, are

    pi = [m, m p_ToTcm (3), Ixx, Iyy, Izz, Ixy, Ixz, Iyz]            [kg, kg m, kg m^2]

As in Drake, Ixy is the *product* of inertia -integral(x y dm). A body made of solid parts has pi = Phi rho, where rho
contains the densities of its materials and Phi depends only on its geometry. Poses X_TE are homogeneous 4 x 4
matrices. All transformations use the pseudo-inertia J (Wensing, Kim & Slotine 2018):

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
# Largest fraction of its volume that a random sample of an uncertain shape may lose.
_MOST_LOST = 0.95
# Bounds of physically possible densities, from aerogel to beyond osmium, [kg/m^3].
DENSITY_MIN, DENSITY_MAX = 0.1, 25_000.0


@runtime_checkable
class Shape(Protocol):
    """Hashable solid with known inertia at unit density. Only drawing code depends on its type."""

    def __hash__(self) -> int:
        return hash((type(self), self.sizes.tobytes()))

    @property
    def sizes(self) -> Array:
        """Lengths of the visible shape, shape (num_sizes,), [m]."""

    @property
    def volume(self) -> float:
        """Volume, [m^3]."""

    def with_sizes(self, sizes: Array) -> "Shape":
        """Returns a solid of the same type with other sizes."""

    def unit_pseudo_inertia(self) -> Array:
        """Computes the pseudo-inertia at a density of 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""

    def find_support(self, direction_E: Array) -> Array:
        """Finds the solid's farthest point along a direction, as a position from Eo in E, shape (3,), [m]."""

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the radius of curvature at the support point along a direction, [m]; infinite if flat.

        A sphere of this radius has the same Gaussian curvature as the surface. Edges, corners and the sides of
        cylinders count as flat. So do triangles, even if they approximate a curved surface.
        """
        return np.inf


class Primitive(Shape):
    """Solid with inertia in closed form, centred at Eo and aligned with E. The fields of a subclass are its lengths.

    Raises:
        BadArgumentError: A length is not finite and positive, or a tuple does not have three lengths.
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
        """Builds the solid from its lengths, in the order of the class's fields, (num_sizes,), [m].

        Raises:
            BadArgumentError: The number of lengths is wrong.
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
        """Computes the pseudo-inertia at 1 kg/m^3 about the centre, (4, 4). Sigma = m/5 diag(a^2, b^2, c^2)."""
        return self.volume * np.diag([*(self.sizes**2 / 5.0), 1.0])

    def find_support(self, direction_E: Array) -> Array:
        """Finds the surface point with outward normal d, shape (3,), [m]: a^2 d / |a d|, with semi-axes a."""
        stretched = self.sizes * direction_E
        return self.sizes * stretched / np.linalg.norm(stretched)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the radius of curvature along a unit vector d, [m]: a b c / |a d|^2, with semi-axes a, b, c."""
        return float(np.prod(self.sizes) / np.sum((self.sizes * direction_E) ** 2))


@dataclass(frozen=True, eq=False)
class LoadedShape(Shape):
    """Solid whose inertia differs from the inertia of its visible shape.

    For example, part of its volume belongs to another solid, or its density varies.

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
        """Lengths of the visible shape, shape (num_sizes,), [m]."""
        return self.outside.sizes

    @property
    def volume(self) -> float:
        """Volume that contributes to the mass, [m^3]."""
        return float(self.J[3, 3])

    def with_sizes(self, sizes: Array) -> "LoadedShape":
        """Stretches the solid along Ex, Ey and Ez until its visible shape has the given lengths."""
        factors = sizes / self.sizes
        radius_and_length = 2
        stretch = factors[[0, 0, 1]] if len(factors) == radius_and_length else factors
        X = np.diag([*stretch, 1.0])
        return LoadedShape(self.outside.with_sizes(sizes), np.prod(stretch) * X @ self.J @ X)

    def unit_pseudo_inertia(self) -> Array:
        """Returns the pseudo-inertia at 1 kg/m^3 about Eo, expressed in E, shape (4, 4)."""
        return self.J.copy()

    def find_support(self, direction_E: Array) -> Array:
        """Finds the visible shape's farthest point along a direction, shape (3,), [m]."""
        return self.outside.find_support(direction_E)

    def compute_curvature_radius(self, direction_E: Array) -> float:
        """Computes the visible shape's radius of curvature along a direction, [m]."""
        return self.outside.compute_curvature_radius(direction_E)


def find_visible(shape: Shape) -> Shape:
    """Returns the visible shape of a solid, which usually is the solid itself."""
    return shape.outside if isinstance(shape, LoadedShape) else shape


def build_inertia_map(
    shapes: Sequence[Shape], poses_TE: Sequence[Array], material_indices: Sequence[int], num_materials: int
) -> Array:
    """Builds the matrix Phi, (10, num_materials), [m^3, m^4, m^5], that maps densities to parameters (docs/model.md).

    The parameters are about To, expressed in T. A material without parts has a column of zeros.

    Args:
        shapes: Solid parts.
        poses_TE: Pose X_TE of each part in the tool, (4, 4).
        material_indices: Index in rho of each part's density.
        num_materials: Number of materials.
    """
    Phi = np.zeros((NUM_PARAMETERS, num_materials))
    for shape, X_TE, index in zip(shapes, poses_TE, material_indices, strict=True):
        Phi[:, index] += parameters_from_pseudo_inertia(X_TE @ shape.unit_pseudo_inertia() @ X_TE.T)
    return Phi


@dataclass(frozen=True)
class Geometry:
    """Inertia map of an object with M materials, and its uncertainty to first order.

    Attributes:
        Phi: Inertia map, (10, M).
        Phi_errors: Change of Phi due to an error of one standard deviation in each of G measurements, (G, 10, M).
    """

    Phi: Array
    Phi_errors: Array

    def compute_parameters(self, rho: Array, errors: Array) -> Array:
        """Computes inertial parameters, (N, 10), from N samples of densities and measurement errors.

        Args:
            rho: Densities, (N, M), [kg/m^3].
            errors: Errors of the G measurements, in standard deviations, (N, G).
        """
        parameters: Array = rho @ self.Phi.T
        for column in np.flatnonzero(self.Phi_errors.any(axis=(0, 1))):  # usually few of many materials
            # A change of volume multiplies all parameters by a factor, and the remaining change is a change of form.
            # To first order the product equals the sum, but this way a large change of volume leaves the centre of
            # mass in place.
            change, Phi = errors @ self.Phi_errors[:, :, column], self.Phi[:, column]
            change /= np.maximum(1.0, -change[:, [0]] / (_MOST_LOST * Phi[0]))
            grown = change[:, [0]] / Phi[0]
            parameters += rho[:, [column]] * ((1.0 + grown) * (Phi + change - grown * Phi) - Phi)
        return parameters

    def compute_covariance(self, rho: Array) -> Array:
        """Computes the covariance of pi due to uncertain geometry, (10, 10), at densities rho, (M,)."""
        errors = self.Phi_errors @ rho  # (G, 10)
        return errors.T @ errors


def compute_point_parameters(p: Array) -> Array:
    """Computes the ten inertial parameters, (..., 10), of unit point masses at positions p, (..., 3), [m]."""
    x, y, z = np.moveaxis(p, -1, 0)
    second = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    return np.stack([np.ones_like(x), x, y, z, *second], axis=-1)


def build_transform_map(X_GT: Array) -> Array:
    """Builds the matrix, (10, 10), that maps parameters about To in T to parameters about Go in G."""
    J = pseudo_inertia_from_parameters(np.eye(NUM_PARAMETERS))
    return np.column_stack([parameters_from_pseudo_inertia(X_GT @ unit @ X_GT.T) for unit in J])


def pseudo_inertia_from_parameters(pi: Array) -> Array:
    """Converts inertial parameters, shape (..., 10), to pseudo-inertias, shape (..., 4, 4)."""
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
    """Converts pseudo-inertias, shape (..., 4, 4), to inertial parameters, shape (..., 10)."""
    second = np.diagonal(J, axis1=-2, axis2=-1)[..., :3]
    moments = second.sum(axis=-1, keepdims=True) - second
    products = -J[..., [0, 0, 1], [1, 2, 2]]
    return np.concatenate([J[..., 3, 3, None], J[..., :3, 3], moments, products], axis=-1)


def spatial_inertia_from_parameters(pi: Array) -> SpatialInertia:
    """Converts inertial parameters, shape (10,), to Drake's spatial inertia M_TTo_T.

    Raises:
        RuntimeError: The parameters are physically impossible.
    """
    mass = float(pi[0])
    if mass == 0.0:
        return SpatialInertia.Zero()
    Gxx, Gyy, Gzz, Gxy, Gxz, Gyz = (float(value) / mass for value in pi[4:])
    return SpatialInertia(mass, pi[1:4] / mass, UnitInertia(Gxx, Gyy, Gzz, Gxy, Gxz, Gyz))


def parameters_from_spatial_inertia(M_TTo_T: SpatialInertia) -> Array:
    """Converts Drake's spatial inertia about To to inertial parameters, shape (10,)."""
    inertia = M_TTo_T.CalcRotationalInertia()
    return np.array([M_TTo_T.get_mass(), *M_TTo_T.CalcComMoment(), *inertia.get_moments(), *inertia.get_products()])
