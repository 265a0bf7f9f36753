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

from affordance.extensions.robots.importer import ImportOptions, extract_arm
from affordance.extensions.robots.kept import write_folder
from affordance.extensions.robots.meshes import find_mesh_file
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
