"""Files of tools and materials: what is read is what is written, of solids and of the bodies of meshes."""

import itertools
import logging
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from helpers.meshes import join, make_box, write_obj
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.files.model_folder import MODELS
from affordance.objects.colour import is_same_colour
from affordance.objects.load import list_materials, load_tools
from affordance.objects.materials import load_materials
from affordance.objects.tool import CAD_PLACE_SD, CAD_VOLUME_SD, Grip

MATERIALS = """
brass: {colour: "#b5a642", density: 8500, density_sd: 87, source: a table}
oak: {colour: "#b07a45", density: 563, density_sd: 56, source: a table}
"""
TOOLS = """
tools:
  - name: hammer
    components:
      - {semi_axes: [1e-1, 1.0e-2, 1E-2], position: [0.1, 0, 0], material: oak}
      - {semi_axes: [0.02, 0.05, 0.02], position: [0.25, 0, 0], rpy_deg: [0, 0, 90], material: oak, looks_like: brass}
"""
HAMMER = (make_box([0, -10, -10], [200, 10, 10]), make_box([200, -50, -20], [240, 50, 20]))  # mm


@pytest.fixture
def files(tmp_path):
    """Reads a tool, with materials in a folder that has a mesh, too."""
    (tmp_path / "materials.yaml").write_text(MATERIALS, encoding="utf-8")
    write_obj(tmp_path / "hammer.obj", *join(*HAMMER))

    def read(tools=TOOLS):
        (tmp_path / "tools.yaml").write_text(tools, encoding="utf-8")
        (tool,) = load_tools(tmp_path / "tools.yaml", load_materials(tmp_path / "materials.yaml"))
        return tool

    return read


@pytest.fixture
def read(files):
    """Reads a hammer of one component."""
    return lambda component, more="": files(
        f"tools:\n  - name: hammer\n    components:\n      - {{{component}}}\n{more}"
    )


TOOL_FILES = sorted((MODELS / "tools").glob("*.yaml")) + [
    MODELS / "workshop" / name for name in ("tools.yaml", "blanks.yaml", "uncommon.yaml")
]


@pytest.mark.parametrize("path", TOOL_FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_one_materials_file_serves_all_tools_files(path):
    assert load_tools(path)
    assert len(load_tools(path)) == len(load_tools(path, load_materials()))
    assert set(list_materials(path)) <= set(load_materials())


def test_data_set_needs_no_materials_of_its_own():
    assert set(list_materials(MODELS / "workshop" / "hps.yaml")) <= set(load_materials())
    assert not (MODELS / "workshop" / "materials.yaml").exists()


def test_no_two_materials_are_of_one_colour():
    """No two materials have the same colour, as knowledge of one would count for the other."""
    for one, other in itertools.combinations(load_materials().values(), 2):
        assert not is_same_colour(one.colour, other.colour), (one.name, other.name)


def test_source_of_a_density_may_be_left_out(tmp_path):
    path = tmp_path / "materials.yaml"
    path.write_text('oak: {colour: "#b07a45", density: 563, density_sd: 56}', encoding="utf-8")
    assert load_materials(path)["oak"].source == "no source is given"


def test_tool_is_read_as_written(files):
    tool = files()
    handle, head = tool.components
    assert handle.shape.semi_axes == (0.1, 0.01, 0.01)
    assert (head.material.name, head.looks_like.name) == ("oak", "brass")
    assert head.shape.semi_axes == (0.02, 0.05, 0.02)
    np.testing.assert_allclose(head.X_TE[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(head.looks_like.colour, [0xB5 / 255, 0xA6 / 255, 0x42 / 255])


def test_errors_of_a_part_are_read_and_otherwise_those_of_a_drawing(files):
    given = files(TOOLS.replace("material: oak}", "material: oak, volume_sd: 0.3, place_sd: 0.01}", 1))
    seen, drawn = given.components
    assert (seen.volume_sd, seen.place_sd) == (0.3, 0.01)
    assert (drawn.volume_sd, drawn.place_sd) == (CAD_VOLUME_SD, CAD_PLACE_SD)
    held = replace(given, grips=(Grip("end", np.eye(4)),)).list_gripped()["end"].scaled(2.0, 1.1)
    assert held.components[0].volume_sd == 0.3


def test_mass_and_centres_follow_from_the_parts(files):
    tool = files()
    volumes = np.array([4 / 3 * np.pi * np.prod(part.shape.semi_axes) for part in tool.components])
    assert tool.mass == pytest.approx(563 * volumes.sum(), rel=1e-14)
    np.testing.assert_allclose(tool.p_TTcentre, [(volumes @ [0.1, 0.25]) / volumes.sum(), 0, 0], atol=1e-16)
    np.testing.assert_allclose(tool.p_TTcm, tool.p_TTcentre, atol=1e-16)


def test_pose_cannot_be_changed_after_reading(files):
    tool = files()
    with pytest.raises(ValueError, match="read-only"):
        tool.components[0].X_TE[0, 3] = 1.0


def test_decoy_appears_as_the_tool_it_imitates():
    *_, last, decoy = load_tools(MODELS / "tools" / "weight.yaml")
    assert decoy.appearance == last.appearance
    assert decoy.mass < 0.2 * last.mass


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


def test_all_formats_hold_the_same_mesh(read, tmp_path):
    vertices, faces = join(*HAMMER)
    for suffix in ("ply", "stl"):
        trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / f"hammer.{suffix}")
    mesh = "mesh: hammer.{}, unit: mm, materials: [oak, brass]"
    pis = [read(mesh.format(suffix)).parameters for suffix in ("obj", "ply", "stl")]
    np.testing.assert_allclose(pis[1], pis[0], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(pis[2], pis[0], rtol=1e-5, atol=1e-9)


def test_materials_follow_the_colours_of_the_file(read, tmp_path):
    vertices, faces = join(*HAMMER)
    colours = np.repeat([[176, 122, 69, 255], [181, 166, 66, 255]], 12, axis=0).astype(np.uint8)
    trimesh.Trimesh(vertices, faces, face_colors=colours, process=False).export(tmp_path / "hammer.ply")
    tool = read("mesh: hammer.ply, unit: mm, colour: file")
    assert [part.material.name for part in tool.components] == ["oak", "brass"]


def test_open_mesh_is_refused_with_its_place(read, tmp_path):
    vertices, faces = make_box([0, 0, 0], [100, 100, 100])
    write_obj(tmp_path / "open.obj", vertices, faces[1:])
    with pytest.raises(BadValueError, match=r"open\.obj.* 3 edges that are open.*near \(0.*a solid must be closed"):
        read("mesh: open.obj, unit: mm, material: oak")


def test_material_of_a_cavity_is_that_around_it(read, tmp_path):
    outer, inner = make_box([0, 0, 0], [100, 100, 100]), make_box([20, 20, 20], [70, 70, 70])
    write_obj(tmp_path / "hollow.obj", *join(outer, (inner[0], inner[1][:, ::-1])))
    hollow = read("mesh: hollow.obj, unit: mm, materials: [oak, oak]")
    assert hollow.mass == pytest.approx(563 * (1e-3 - 1.25e-4))
    with pytest.raises(BadValueError, match="the wall of a cavity in shell 0, must be that shell's 'oak'"):
        read("mesh: hollow.obj, unit: mm, materials: [oak, brass]")


def test_volume_that_bodies_of_a_mesh_share_is_counted_once(read, tmp_path, caplog):
    boxes = make_box([0, 0, 0], [100, 100, 100]), make_box([50, 0, 0], [150, 100, 100])
    write_obj(tmp_path / "overlap.obj", *join(*boxes))
    with caplog.at_level(logging.WARNING):
        tool = read("mesh: overlap.obj, unit: mm, materials: [oak, oak]")
    assert tool.mass == pytest.approx(1.5 * 0.563)
    assert "hammer: its parts share 25.0 % of their volume, which is counted once" in caplog.text
    merged = read("mesh: overlap.obj, unit: mm, material: oak")
    np.testing.assert_allclose(merged.parameters, tool.parameters, rtol=1e-9, atol=1e-15)


def test_striking_face_belongs_to_the_part_it_lies_on(read):
    strike = "    strikes: {poll: {point: [0.22, 0.05, 0], normal: [0, 1, 0]}}\n"
    tool = read("mesh: hammer.obj, unit: mm, materials: [oak, brass]", strike)
    handle, head = tool.components
    assert not handle.strikes
    p_TQ, normal_T = head.strikes[0].express(head.X_TE)
    np.testing.assert_allclose(p_TQ, [0.22, 0.05, 0], atol=1e-12)
    np.testing.assert_allclose(normal_T, [0, 1, 0], atol=1e-12)


def test_tools_of_too_many_parts_are_refused(tmp_path):
    part = "{semi_axes: [0.1, 0.01, 0.01], position: [0, 0, 0], material: oak}"
    names = [f"  - {{name: t{number}, components: [{part}, {part}]}}" for number in range(101)]
    path = tmp_path / "tools.yaml"
    path.write_text("\n".join(["tools:", *names[:100]]), encoding="utf-8")
    assert len(load_tools(path)) == 100
    path.write_text("\n".join(["tools:", *names]), encoding="utf-8")
    assert refuse(load_tools, path).endswith("tools: have 202 parts in all, must have at most 200")


FIRST, PART, SIZES = "  - name: hammer", "material: oak}", "[1e-1, 1.0e-2, 1E-2]"  # in TOOLS
HUNDREDS_OF_DIGITS = "1" + 400 * "0"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("name: hammer", "nome: hammer", "tools.yaml: tools[0].name: is missing"),
        (FIRST, f"  - 3\n{FIRST}", "tools[0]: is 3, must be a mapping"),
        (f"semi_axes: {SIZES}, ", "", "tools[0].components[0].semi_axes: is missing"),
        (SIZES, "[0.1, 0.01]", "semi_axes: is [0.1, 0.01], must be a list of 3 numbers"),
        (SIZES, "[0.1, -0.01, 0.01]", "semi_axes[1]: is -0.01, must be from 0.0001 to 1"),
        (SIZES, "[0.1, 0, 0.01]", "semi_axes[1]: is 0, must be from 0.0001 to 1"),
        (SIZES, "[0.1, .nan, 0.01]", "semi_axes[1]: is nan, must be from 0.0001 to 1"),
        (SIZES, "[0.1, .inf, 0.01]", "semi_axes[1]: is inf, must be from 0.0001 to 1"),
        (SIZES, "[100, 0.01, 0.01]", "semi_axes[0]: is 100, must be from 0.0001 to 1"),
        (SIZES, f"[{HUNDREDS_OF_DIGITS}, 0.01, 0.01]", f"semi_axes[0]: is 1{56 * '0'}..., must be from 0.0001 to 1"),
        (SIZES, "[0.1, wide, 0.01]", "semi_axes[1]: is 'wide', must be a number"),
        (SIZES, "[0.1, true, 0.01]", "semi_axes[1]: is True, must be a number"),
        ("position: [0.25, 0, 0]", "position: [200, 0, 0]", "position[0]: is 200, must be from -1 to 1"),
        ("[0, 0, 90]", "[0, 0, 900]", "rpy_deg[2]: is 900, must be from -360 to 360"),
        (PART, "material: oak, material: oak}", "is not YAML: the key 'material' twice"),
        (PART, "material: gold}", "material: is 'gold', must be one of brass, oak"),
        (PART, "material: oak, volume_sd: 25}", "components[0].volume_sd: is 25, must be from 0 to 0.6"),
        (PART, "material: oak, place_sd: 9}", "components[0].place_sd: is 9, must be from 0 to 0.1"),
        (PART, "material: 3}", "material: is 3, must be a non-empty text"),
        (PART, "material: oak, colour: red}", "components[0].colour: is 'red', must be red, green and blue"),
        ("looks_like: brass", "looks_like: gold", "components[1].looks_like: is 'gold', must be one of"),
    ],
)
def test_mistake_in_a_tool_is_refused_with_its_place(files, old, new, said):
    assert said in refuse(files, TOOLS.replace(old, new, 1))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "tools.yaml: is empty, must be a mapping"),
        ("tools: []", "tools: is [], must be a list with at least one entry"),
        ("tools:\n  - {name: hammer, components: []}", "components: is [], must be a list with at least one entry"),
        ("tools:\n  - {name: hammer, components: }", "components: is empty, must be a list with at least one entry"),
        ("tools: [", "tools.yaml: line 1, column 9: is not YAML"),
        ("a: b: c", "tools.yaml: line 1, column 5: is not YAML"),
        (
            TOOLS + TOOLS.replace("\ntools:\n", ""),
            "tools[1].name: is 'hammer', the name of an earlier tool of the file",
        ),
    ],
)
def test_file_without_tools_is_refused(files, text, said):
    assert said in refuse(files, text)


@pytest.mark.parametrize(
    ("component", "said"),
    [
        ("mesh: hammer.obj, unit: furlong, material: oak", "components[0].unit: is 'furlong', must be one of"),
        ("mesh: hammer.obj, material: oak", "components[0].unit: is missing"),
        (
            "mesh: hammer.obj, unit: m, material: oak",
            "is 240 m long if its unit is m, must be from 0.001 to 1 m; it would be 0.24 m in mm",
        ),
        ("mesh: hammer.glb, unit: m, material: oak", "is a .glb, must be one of .obj, .ply, .stl; export it as"),
        ("mesh: hatchet.obj, unit: m, material: oak", "hatchet.obj: cannot be read: no such file"),
        ("mesh: hammer.obj, unit: mm, materials: [oak]", "has 1 entries, must have 2: one per shell"),
        ("mesh: hammer.obj, unit: mm, materials: [oak, gold]", "is 'gold', must be one of brass, oak"),
        ("mesh: hammer.obj, unit: mm, colour: file", "the file has no colour for part 0"),
        (
            'mesh: hammer.obj, unit: mm, colour: "#00ff00"',
            "is the colour of 0 materials, must be of exactly one; the nearest",
        ),
        ("mesh: hammer.obj, unit: mm, shell: 2, material: oak", "components[0].shell: is 2"),
        ("box: [1, 2, 3], position: [0, 0, 0], material: oak", "components[0].box"),
        (
            "box: [0.1, 0.1, 0.1], capsule: [0.1, 0.1], position: [0, 0, 0], material: oak",
            "is given together with box, must be the only one",
        ),
        ("position: [0, 0, 0], material: oak", "components[0].semi_axes: is missing: one of semi_axes, box,"),
    ],
)
def test_part_that_is_no_solid_is_refused(read, component, said):
    assert said in refuse(read, component)


@pytest.mark.parametrize(
    ("face", "said"),
    [
        (
            "point: [0.22, 0.045, 0], normal: [0, 1, 0]",
            "is 5 mm from the nearest place where a part ends along the normal, must be at most 0.2 mm from it",
        ),
        (
            "point: [0.22, 0.05, 0.03], normal: [0, 1, 0]",
            " mm from the nearest place where a part ends along the normal",
        ),
        ("point: [0.22, 0.05, 0], normal: [0, 0, 0]", "poll.normal: has a length of 0, must be at least 0.01"),
    ],
)
def test_striking_face_off_every_part_is_refused(read, face, said):
    head = "mesh: hammer.obj, unit: mm, materials: [oak, brass]"
    assert said in refuse(read, head, f"    strikes: {{poll: {{{face}}}}}\n")
