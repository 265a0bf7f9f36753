import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from scipy.spatial.transform import Rotation

from affordance.objects.inertia import (
    Ellipsoid,
    build_inertia_map,
    compute_point_parameters,
    parameters_from_pseudo_inertia,
    parameters_from_spatial_inertia,
    spatial_inertia_from_parameters,
)


def draw_parts(rng, count):
    shapes = [Ellipsoid(tuple(rng.uniform(0.01, 0.2, 3))) for _ in range(count)]
    turns = (RotationMatrix(Rotation.random(rng=rng).as_matrix()) for _ in range(count))
    poses = [RigidTransform(turn, rng.uniform(-0.3, 0.3, 3)).GetAsMatrix4() for turn in turns]
    return shapes, poses


def compose_with_drake(shapes, poses, densities):
    total = SpatialInertia.Zero()
    for shape, X_TE, density in zip(shapes, poses, densities, strict=True):
        part = SpatialInertia.SolidEllipsoidWithDensity(density, *shape.semi_axes)
        total += part.ReExpress(RotationMatrix(X_TE[:3, :3])).Shift(-X_TE[:3, 3])
    return total


@pytest.mark.parametrize("count", [1, 2, 5])
def test_inertia_map_agrees_with_drakes_composite_inertia(rng, count):
    for _ in range(20):
        shapes, poses = draw_parts(rng, count)
        densities = rng.uniform(100, 9000, count)
        Phi = build_inertia_map(shapes, poses, range(count), count)
        expected = parameters_from_spatial_inertia(compose_with_drake(shapes, poses, densities))
        np.testing.assert_allclose(Phi @ densities, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_parts_of_one_material_add_up_in_its_column(rng):
    shapes, poses = draw_parts(rng, 4)
    apart = build_inertia_map(shapes, poses, range(4), 4)
    together = build_inertia_map(shapes, poses, [0, 2, 0, 2], 3)
    np.testing.assert_allclose(together[:, 0], apart[:, 0] + apart[:, 2], atol=1e-15)
    np.testing.assert_allclose(together[:, 2], apart[:, 1] + apart[:, 3], atol=1e-15)
    assert not together[:, 1].any()


def test_unit_inertia_of_ellipsoid_agrees_with_monte_carlo_integration(rng):
    semi_axes = np.array([0.3, 0.2, 0.1])
    points = rng.uniform(-1, 1, (400_000, 3)) * semi_axes
    inside = points[((points / semi_axes) ** 2).sum(axis=1) <= 1]
    cell = np.prod(2 * semi_axes) / 400_000
    J = Ellipsoid(tuple(semi_axes)).unit_pseudo_inertia()
    np.testing.assert_allclose(J[3, 3], len(inside) * cell, rtol=5e-3)
    np.testing.assert_allclose(np.diag(J)[:3], (inside**2).sum(axis=0) * cell, rtol=1e-2)


def test_parameters_of_a_pseudo_inertia_are_its_moments(rng):
    """Parameters of a pseudo-inertia agree to 1e-12 with sums over a cloud of point masses."""
    masses, points = rng.uniform(0.1, 1.0, 20), rng.normal(size=(20, 3))
    homogeneous = np.hstack([points, np.ones((20, 1))])
    pi = parameters_from_pseudo_inertia(np.einsum("i,ij,ik->jk", masses, homogeneous, homogeneous))
    inertia = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, points, strict=True))
    np.testing.assert_allclose(pi[:4], [masses.sum(), *(masses @ points)], atol=1e-12)
    np.testing.assert_allclose(pi[4:7], np.diag(inertia), atol=1e-12)
    np.testing.assert_allclose(pi[7:], [inertia[0, 1], inertia[0, 2], inertia[1, 2]], atol=1e-12)


def test_spatial_inertia_and_parameters_are_inverse_maps(rng):
    shapes, poses = draw_parts(rng, 3)
    pi = build_inertia_map(shapes, poses, range(3), 3) @ [700.0, 7850.0, 8500.0]
    np.testing.assert_allclose(
        parameters_from_spatial_inertia(spatial_inertia_from_parameters(pi)), pi, rtol=1e-13, atol=1e-15
    )
    assert spatial_inertia_from_parameters(np.zeros(10)).get_mass() == 0.0


def test_impossible_inertia_is_refused_by_drake():
    with pytest.raises(RuntimeError, match="IsPhysicallyValid"):
        spatial_inertia_from_parameters(np.array([1.0, 0, 0, 0, 1.0, 0.1, 0.1, 0, 0, 0]))


def test_point_masses_have_the_inertia_that_drake_says():
    points = np.random.default_rng(3).standard_normal((2, 4, 3))
    found = compute_point_parameters(points)
    assert found.shape == (2, 4, 10)
    for p, pi in zip(points.reshape(-1, 3), found.reshape(-1, 10), strict=True):
        drake = parameters_from_spatial_inertia(SpatialInertia(1.0, p, UnitInertia.PointMass(p)))
        np.testing.assert_allclose(pi, drake, atol=1e-12)
