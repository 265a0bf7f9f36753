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


@pytest.mark.parametrize(
    ("component", "message"),
    [
        ("mesh: hammer.obj, unit: furlong, material: oak", "must be one of"),
        ("mesh: hammer.obj, material: oak", "unit"),
        (
            "mesh: hammer.obj, unit: m, material: oak",
            "is 240 m long if its unit is m, must be from 0.001 to 1 m; it ",
        ),
        ("mesh: hammer.glb, unit: m, material: oak", "is a .glb, must be one of .obj, .ply, .stl; export it as"),
        ("mesh: hatchet.obj, unit: m, material: oak", "no such file"),
        ("mesh: hammer.obj, unit: mm, materials: [oak]", "has 1 entries, must have 2: one a shell"),
        ("mesh: hammer.obj, unit: mm, materials: [oak, gold]", "is 'gold', must be one of brass, oak"),
        ("mesh: hammer.obj, unit: mm, colour: file", "the file shows none of part 0"),
        (
            'mesh: hammer.obj, unit: mm, colour: "#00ff00"',
            "is the colour of 0 materials, must be that of one; the near",
        ),
        ("mesh: hammer.obj, unit: mm, shell: 2, material: oak", "shell"),
        ("box: [1, 2, 3], position: [0, 0, 0], material: oak", "box"),
        (
            "box: [0.1, 0.1, 0.1], capsule: [0.1, 0.1], position: [0, 0, 0], material: oak",
            "is given with box, only one of",
        ),
        ("position: [0, 0, 0], material: oak", "semi_axes"),
    ],
)
def test_bad_parts_are_refused_in_one_line(read, component, message):
    with pytest.raises(BadValueError) as caught:
        read(component)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (strike("[0.22, 0.045, 0]"), "is 5 mm from where any part ends along the normal, must be at most 0.2 mm"),
        (strike("[0.22, 0.05, 0.03]"), " mm from where any part ends"),
        (strike("[0.22, 0.05, 0]", "[0, 0, 0]"), "has a length of 0, must be at least 0.01"),
    ],
)
def test_face_that_is_none_is_refused(read, more, message):
    with pytest.raises(BadValueError) as caught:
        read("mesh: hammer.obj, unit: mm, materials: [oak, brass]", more)
    assert message in str(caught.value)
