"""Superquadrics: volume, distances and meshes against closed forms and brute force."""

import numpy as np
import pytest
import trimesh

from affordance.extensions.pixels.photographs.superquadric import Superquadric, build_mesh


def build(semi_axes, exponents):
    return Superquadric(np.array(semi_axes), np.array(exponents), np.eye(4))


def test_volume_of_an_ellipsoid_and_limits_of_box_and_cylinder():
    axes = (0.02, 0.03, 0.05)
    assert build(axes, (1.0, 1.0)).volume == pytest.approx(4.0 / 3.0 * np.pi * np.prod(axes), rel=1e-9)
    assert build(axes, (1e-3, 1e-3)).volume == pytest.approx(8.0 * np.prod(axes), rel=1e-4)
    assert build(axes, (1e-3, 1.0)).volume == pytest.approx(2.0 * np.pi * np.prod(axes), rel=2e-3)


@pytest.mark.parametrize("exponents", [(0.1, 0.1), (0.2, 1.0), (0.7, 0.4), (1.0, 1.0)])
def test_volume_mesh_and_sign_of_distances_agree_with_monte_carlo(exponents):
    solid = build((0.02, 0.03, 0.05), exponents)
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (200_000, 3)) * solid.semi_axes
    share = (solid.measure_distances(points) < 0.0).mean()
    assert share * 8.0 * np.prod(solid.semi_axes) == pytest.approx(solid.volume, rel=0.01)
    mesh = trimesh.Trimesh(*build_mesh(solid), process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(solid.volume, rel=1e-9)
    assert np.abs(solid.measure_distances(mesh.vertices)).max() < 5e-4


def test_distances_of_a_sphere_are_exact_and_rays_are_measured_where_they_are_deepest():
    ball = build((0.04, 0.04, 0.04), (1.0, 1.0))
    points = np.random.default_rng(1).normal(0.0, 0.05, (100, 3))
    np.testing.assert_allclose(ball.measure_distances(points), np.linalg.norm(points, axis=1) - 0.04, atol=1e-12)
    ray = np.linspace([-0.1, 0.01, 0.0], [0.1, 0.01, 0.0], 201)
    assert ball.measure_nearest(ray[None])[0] == pytest.approx(-0.03, abs=1e-12)
