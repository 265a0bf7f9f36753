"""Meshes of strangers: no promise or name in a file takes more memory than the file itself."""

import struct

import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.files import mesh_reader
from affordance.files.mesh_reader import load_scene, read_triangles

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\nend_header\n"


@pytest.fixture
def write(tmp_path):
    def write(name, content):
        path = tmp_path / "meshes" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("a.ply", (PLY + FACES).format("ascii", 10**12, 1) + "0 0 0\n", "promises 1000000000000 entries, has "),
        ("a.ply", (PLY + FACES).format("binary_little_endian", 1, 10**30), "promises 10000000000000000000 entries"),
        (
            "a.stl",
            b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50,
            "promises 4294967295 triangles, has 134 bytes",
        ),
        ("a.obj", "v 0 0 0\nf 1 2 999999999999\n", "is no readable OBJ file: "),
        ("a.obj", "", "contains no triangles"),
        ("a.ply", "ply\n", "is no readable PLY file: "),
        ("a.stl", "solid\nfacet", "contains no triangles"),
    ],
)
def test_mesh_that_promises_more_than_it_holds_is_one_line(write, name, content, problem):
    assert f"{name}: {problem}" in refuse(read_triangles, write(name, content))


def test_meshes_are_bounded_in_size(write, monkeypatch):
    monkeypatch.setattr(mesh_reader, "MESH", 10)
    assert "must have at most 1e-05 MB" in refuse(read_triangles, write("a.obj", TRIANGLE))


MATERIAL = "newmtl m\nKd 1 0 0\n"


@pytest.mark.parametrize("place", ["../outside.mtl", "{}/outside.mtl", "link.mtl", "pipe.mtl"])
def test_materials_are_read_beside_the_mesh_only(write, tmp_path, place):
    """Colours of a material file in the mesh's own folder are taken; a file elsewhere is not read."""
    write("near.mtl", MATERIAL)
    near = write("a.obj", f"mtllib near.mtl\n{TRIANGLE.replace('f ', 'usemtl m' + chr(10) + 'f ')}")
    assert read_triangles(near).colours.tolist() == [[1.0, 0.0, 0.0]]
    (tmp_path / "outside.mtl").write_text(MATERIAL)
    (tmp_path / "meshes" / "link.mtl").symlink_to("/dev/zero")
    (tmp_path / "meshes" / "pipe.mtl").symlink_to("/dev/stdin")
    far = write("b.obj", near.read_text().replace("near.mtl", place.format(tmp_path)))
    assert read_triangles(far).colours.tolist() != [[1.0, 0.0, 0.0]]


COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_nodes>{nodes}</library_nodes>
<library_visual_scenes><visual_scene id="s">{scene}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
NODE = '<node id="{}">{}</node>'
INSTANCE = '<instance_node url="#{}"/>'


def test_collada_that_is_no_xml_is_one_line(write):
    text = COLLADA.format(nodes="<node>", scene="")
    assert "is not XML: mismatched tag" in refuse(load_scene, write("a.dae", text))


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # pycollada sets shapes of arrays
def test_collada_that_repeats_a_mesh_is_read(write):
    mesh = NODE.format("n0", '<instance_geometry url="#g"/>')
    text = COLLADA.format(nodes=mesh, scene=NODE.format("r", INSTANCE.format("n0") * 3))
    assert sum(len(part.faces) for part in load_scene(write("a.dae", text)).dump()) == 3


def test_collada_with_entities_is_one_line(write):
    bomb = '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>'
    with pytest.raises(BadValueError, match=r"a.dae: line 1: defines the entity 'a', must be expanded"):
        load_scene(write("a.dae", f"{bomb}<COLLADA>&b;</COLLADA>"))
