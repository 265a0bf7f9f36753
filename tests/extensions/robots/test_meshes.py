"""Drawings of an arm: meshes where they are available, as files that Drake draws, else capsules."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh
from helpers.robot_files import write_urdf
from pydrake.geometry import Role
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from scipy.spatial import cKDTree

from affordance.extensions.robots.importer import ImportOptions, extract_arm
from affordance.extensions.robots.kept import write_folder
from affordance.extensions.robots.meshes import find_mesh_file, simplify
from affordance.objects.drake_geometry import write_obj
from affordance.plant.arm import ARM
from affordance.plant.load import parse_arm


def write_meshes(folder: Path, **meshes: trimesh.Trimesh) -> None:
    """Writes meshes to where the robot's file looks for them, by the name of its package."""
    (folder / "nowhere" / "meshes").mkdir(parents=True)
    for name, mesh in meshes.items():
        mesh.export(folder / "nowhere" / "meshes" / f"{name}.stl")


def import_into(folder: Path, *, with_meshes: bool = True) -> Sequence[str]:
    """Imports an arm of four joints into the folder ``models``; returns remarks on its shapes."""
    imported = extract_arm(write_urdf(folder), ImportOptions("right_tool"))
    return write_folder(*imported, folder / "models", source="a test", with_meshes=with_meshes)


def test_a_mesh_keeps_its_shape_and_place_and_loses_triangles_it_does_not_need(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    assert len(ball.faces) > 20000
    write_meshes(tmp_path, right_2=ball.apply_translation([0.1, 0.0, 0.02]))
    import_into(tmp_path)
    (written,) = (tmp_path / "models" / "meshes").glob("*.obj")
    drawn = trimesh.load_mesh(written)
    assert len(drawn.faces) <= 4000
    assert drawn.volume == pytest.approx(ball.volume, rel=0.01)
    np.testing.assert_allclose(drawn.bounds, ball.bounds, atol=2e-3)


def test_the_strict_program_draws_what_was_written(tmp_path: Path) -> None:
    write_meshes(tmp_path, right_2=trimesh.creation.box([0.1, 0.05, 0.05]))
    import_into(tmp_path)
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.0)
    parse_arm(plant, tmp_path / "models" / ARM.name)
    inspector = scene_graph.model_inspector()
    shapes = [
        type(inspector.GetShape(geometry)).__name__ for geometry in inspector.GetAllGeometryIds(Role.kIllustration)
    ]
    # The torso carries the arm; where its mesh is nowhere it is left out.
    assert sorted(shapes) == ["Capsule", "Capsule", "Capsule", "Mesh"]


def test_without_meshes_every_link_is_a_capsule(tmp_path: Path) -> None:
    write_meshes(tmp_path, right_2=trimesh.creation.box([0.1, 0.05, 0.05]))
    import_into(tmp_path, with_meshes=False)
    assert not (tmp_path / "models" / "meshes").exists()
    assert (tmp_path / "models" / "arm.sdf").read_text().count("<capsule>") == 4


def test_a_damaged_mesh_is_said_and_drawn_as_a_capsule(tmp_path: Path) -> None:
    write_meshes(tmp_path)
    (tmp_path / "nowhere" / "meshes" / "right_3.stl").write_bytes(b"solid broken\nfacet no")
    remarks = import_into(tmp_path)
    assert any(remark.startswith("the mesh right_3.stl cannot be read") for remark in remarks)
    assert (tmp_path / "models" / "arm.sdf").read_text().count("<capsule>") == 4


def test_a_mesh_is_found_by_its_package_in_a_folder_above_or_beside_the_file(tmp_path: Path) -> None:
    robot = tmp_path / "robots" / "urdf" / "a.urdf"
    robot.parent.mkdir(parents=True)
    for place in ("pkg/m.stl", "robots/meshes/n.stl", "robots/urdf/o.stl"):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_text("")
    assert find_mesh_file("package://pkg/m.stl", robot) == tmp_path / "pkg" / "m.stl"
    assert find_mesh_file("package://robot/meshes/n.stl", robot) == tmp_path / "robots" / "meshes" / "n.stl"
    assert find_mesh_file("o.stl", robot) == tmp_path / "robots" / "urdf" / "o.stl"
    assert find_mesh_file("package://pkg/absent.stl", robot) is None


def test_triangles_are_written_with_their_normals_and_none_of_no_area() -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    text = write_obj(vertices, np.array([[0, 1, 2], [0, 1, 1]]))
    assert "vn 0 0 1" in text
    assert text.count("\nf ") == 1


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
