import logging

import numpy as np
import pytest
import trimesh
from helpers.meshes import join, make_box, write_obj

from affordance.exceptions import BadValueError
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials

MATERIALS = """
brass: {colour: "#d4a017", density: 8500, density_sd: 87, source: a table}
oak: {colour: "#b07a45", density: 563, density_sd: 56, source: a table}
"""
HAMMER = (make_box([0, -10, -10], [200, 10, 10]), make_box([200, -50, -20], [240, 50, 20]))  # mm


@pytest.fixture
def read(tmp_path):
    (tmp_path / "materials.yaml").write_text(MATERIALS)
    write_obj(tmp_path / "hammer.obj", *join(*HAMMER))

    def read(component, more=""):
        (tmp_path / "tools.yaml").write_text(
            f"tools:\n  - name: hammer\n    components:\n      - {{{component}}}\n{more}"
        )
        return load_tools(tmp_path / "tools.yaml", load_materials(tmp_path / "materials.yaml"))[0]

    read.folder = tmp_path
    return read


@pytest.mark.parametrize(
    ("component", "mass"),
    [
        ("box: [0.1, 0.1, 0.1], position: [0, 0, 0], material: brass", 8.5),
        ("cylinder: [0.1, 0.1], position: [0, 0, 0], material: oak", 0.563 * np.pi),
        ("capsule: [0.1, 0.1], position: [0, 0, 0], material: oak", 0.563 * np.pi * (1 + 4 / 3)),
        ("mesh: hammer.obj, unit: mm, materials: [oak, brass]", 563 * 8e-5 + 8500 * 1.6e-4),
        ("mesh: hammer.obj, unit: mm, material: oak", 563 * 2.4e-4),
        ("mesh: hammer.obj, unit: mm, shell: 1, material: brass", 8500 * 1.6e-4),
    ],
)
def test_solids_weigh_what_they_should(read, component, mass):
    assert read(component).mass == pytest.approx(mass, rel=1e-6)


def test_all_formats_hold_the_same_mesh(read):
    vertices, faces = join(*HAMMER)
    for suffix in ("ply", "stl"):
        trimesh.Trimesh(vertices, faces, process=False).export(read.folder / f"hammer.{suffix}")
    pis = [
        read(f"mesh: hammer.{suffix}, unit: mm, materials: [oak, brass]").parameters
        for suffix in ("obj", "ply", "stl")
    ]
    np.testing.assert_allclose(pis[1], pis[0], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(pis[2], pis[0], rtol=1e-5, atol=1e-9)


def test_materials_follow_the_colours_of_the_file(read):
    vertices, faces = join(*HAMMER)
    colours = np.repeat([[176, 122, 69, 255], [212, 160, 23, 255]], 12, axis=0).astype(np.uint8)
    trimesh.Trimesh(vertices, faces, face_colors=colours, process=False).export(read.folder / "hammer.ply")
    tool = read("mesh: hammer.ply, unit: mm, colour: file")
    assert [part.material.name for part in tool.components] == ["oak", "brass"]


def test_open_mesh_is_refused_with_its_place(read):
    vertices, faces = make_box([0, 0, 0], [100, 100, 100])
    write_obj(read.folder / "open.obj", vertices, faces[1:])
    with pytest.raises(BadValueError, match=r"open\.obj.* 3 edges that are open.*near \(0.*a solid must be closed"):
        read("mesh: open.obj, unit: mm, material: oak")


def test_material_of_a_cavity_is_that_around_it(read):
    outer, inner = make_box([0, 0, 0], [100, 100, 100]), make_box([20, 20, 20], [70, 70, 70])
    write_obj(read.folder / "hollow.obj", *join(outer, (inner[0], inner[1][:, ::-1])))
    hollow = read("mesh: hollow.obj, unit: mm, materials: [oak, oak]")
    assert hollow.mass == pytest.approx(563 * (1e-3 - 1.25e-4))
    with pytest.raises(BadValueError, match="the wall of a cavity in shell 0, must be its 'oak'"):
        read("mesh: hollow.obj, unit: mm, materials: [oak, brass]")


def test_overlapping_bodies_are_counted_twice_with_a_warning(read, caplog):
    write_obj(
        read.folder / "overlap.obj",
        *join(make_box([0, 0, 0], [100, 100, 100]), make_box([50, 0, 0], [150, 100, 100])),
    )
    with caplog.at_level(logging.WARNING):
        tool = read("mesh: overlap.obj, unit: mm, materials: [oak, oak]")
    assert tool.mass == pytest.approx(2 * 0.563)
    assert "25.0 % of the volume lies in two bodies at once" in caplog.text


def strike(point, normal="[0, 1, 0]"):
    return f"    strikes:\n      poll: {{point: {point}, normal: {normal}}}\n"


def test_striking_face_belongs_to_the_part_it_lies_on(read):
    tool = read("mesh: hammer.obj, unit: mm, materials: [oak, brass]", strike("[0.22, 0.05, 0]"))
    handle, head = tool.components
    assert not handle.strikes
    p_TQ, normal_T = head.strikes[0].express(head.X_TE)
    np.testing.assert_allclose(p_TQ, [0.22, 0.05, 0], atol=1e-12)
    np.testing.assert_allclose(normal_T, [0, 1, 0], atol=1e-12)
