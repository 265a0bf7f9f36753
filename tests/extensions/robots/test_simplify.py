"""Meshes as CAD programs export them keep their shape with fewer triangles."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from affordance.extensions.robots.simplify import simplify


def measure_gap(one: trimesh.Trimesh, other: trimesh.Trimesh) -> float:
    """Largest distance from points of a mesh to those of another, both sampled, as part of its size."""
    here, there = (
        trimesh.sample.sample_surface(mesh, 20_000, seed=seed)[0] for seed, mesh in enumerate((one, other))
    )
    return float(cKDTree(there).query(here)[0].max() / np.linalg.norm(one.extents))


def build_cracked(rng: np.random.Generator) -> trimesh.Trimesh:
    """A body with two handles on thin rods, of which no two triangles share a vertex."""
    parts = [
        trimesh.creation.box([0.6, 0.2, 0.15]),
        *(trimesh.creation.box([0.3, 0.02, 0.02]).apply_translation([x, 0.0, 0.0]) for x in (-0.45, 0.45)),
        *(trimesh.creation.icosphere(2, 0.06).apply_translation([x, 0.0, 0.0]) for x in (-0.6, 0.6)),
    ]
    whole = trimesh.util.concatenate(parts).subdivide_to_size(0.02)
    corners = whole.triangles.reshape(-1, 3) + rng.normal(0.0, 1e-5, (3 * len(whole.faces), 3))
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


@pytest.mark.parametrize("most", [500, 1500, 4000])
def test_a_mesh_of_cracks_keeps_all_its_parts_within_the_bound(rng: np.random.Generator, most: int) -> None:
    mesh = build_cracked(rng)
    assert len(mesh.faces) > 8000
    vertices, faces = simplify(np.asarray(mesh.vertices), np.asarray(mesh.faces), most)
    reduced = trimesh.Trimesh(vertices, faces, process=False)
    assert 0.5 * most < len(faces) <= most
    assert measure_gap(mesh, reduced) < 0.03
    assert measure_gap(reduced, mesh) < 0.03


def test_flat_faces_and_edges_stay_where_they_are(rng: np.random.Generator) -> None:
    """Edges of a box stay in its planes to 1e-6, wherever the grid cuts them, and the volume is the same."""
    box = trimesh.creation.box([0.3, 0.2, 0.1]).subdivide_to_size(0.005)
    vertices, faces = simplify(np.asarray(box.vertices), np.asarray(box.faces), 1000)
    assert len(faces) <= 1000
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [0.3, 0.2, 0.1], atol=1e-6)
    assert np.abs(np.abs(vertices) / [0.15, 0.1, 0.05] - 1.0).min(axis=1).max() < 1e-6
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(box.volume, rel=1e-6)


def test_a_mesh_of_few_triangles_is_left_alone() -> None:
    box = trimesh.creation.box()
    vertices, faces = simplify(np.asarray(box.vertices), np.asarray(box.faces), 12)
    np.testing.assert_array_equal(vertices, box.vertices)
    np.testing.assert_array_equal(faces, box.faces)


def test_triangles_without_area_make_no_numbers_that_are_none() -> None:
    vertices = np.repeat(np.linspace(0.0, 1.0, 50)[:, None], 3, axis=1)  # on a line
    faces = np.stack([np.arange(48), np.arange(1, 49), np.arange(2, 50)], axis=1)
    placed, left = simplify(vertices, faces, 20)
    assert len(left) <= 20
    assert np.isfinite(placed).all()
