"""Files of objects: centre of mass and moments are those of the file where they are possible, as Drake has them."""

import numpy as np
import pytest
from helpers.answers import answer
from helpers.refusals import refuse
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.extensions.robots.object_file import read_object
from affordance.objects.inertia import parameters_from_spatial_inertia
from affordance.objects.materials import load_materials

MATERIALS = load_materials()
INERTIAL = (
    '<inertial><origin xyz="0.03 0.02 0"/><mass value="1.0"/>'
    '<inertia ixx="0.0021" iyy="0.0026" izz="0.0030" ixy="-0.0006" ixz="0" iyz="0"/></inertial>'
)
SHAPE = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
GRIP = '<link name="grip"/><joint name="g" type="fixed"><parent link="box"/><child link="grip"/></joint>'
BOX = f'<robot name="box"><link name="box">{INERTIAL}{SHAPE}</link>{GRIP}</robot>'
# Two links and three shapes, one of them tilted, with inertias in tilted axes.
CLUB = (
    '<robot name="club"><link name="shaft"><inertial><origin xyz="0.01 0 0.02" rpy="0.3 0.2 0.1"/><mass value="0.4"/>'
    '<inertia ixx="0.003" iyy="0.0031" izz="0.0002" ixy="0" ixz="0.0001" iyz="0"/></inertial>'
    '<visual><geometry><cylinder radius="0.02" length="0.3"/></geometry></visual>'
    '<visual><origin xyz="0 0.05 0.1" rpy="0.5 0 0"/><geometry><box size="0.04 0.06 0.05"/></geometry></visual>'
    '</link><link name="head"><inertial><origin xyz="0.005 0 0.01" rpy="0 0.4 0"/><mass value="0.9"/>'
    '<inertia ixx="0.0006" iyy="0.0007" izz="0.0008" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<visual><geometry><sphere radius="0.04"/></geometry></visual></link>'
    '<joint name="j" type="fixed"><parent link="shaft"/><child link="head"/>'
    '<origin xyz="0.01 0 0.2" rpy="0 0.7 0.2"/></joint></robot>'
)


def read(tmp_path, text):
    (path := tmp_path / "box.urdf").write_text(text)
    return read_object(path, MATERIALS)


def sum_inertia(path):
    """Computes ten parameters about the root link's origin by Drake."""
    plant = MultibodyPlant(0.0)
    (model,) = Parser(plant).AddModels(str(path))
    bodies = plant.GetBodyIndices(model)
    plant.WeldFrames(plant.world_frame(), plant.get_body(bodies[0]).body_frame(), RigidTransform())
    plant.Finalize()
    M = plant.CalcSpatialInertia(plant.CreateDefaultContext(), plant.world_frame(), bodies)
    return parameters_from_spatial_inertia(M)


def sum_weighed(tool):
    """Computes ten parameters of a tool whose links weigh what was measured; each link's parts share its mass."""
    pi = np.zeros(10)
    for weighing in tool.weighings:
        parts = [tool.components[k] for k in weighing.parts]
        scale = weighing.mass / sum(part.shape.volume for part in parts)
        own = type(tool)("link", tuple(parts)).with_densities({part.looks_like.colour: scale for part in parts})
        pi += own.parameters
    return pi


@pytest.mark.parametrize("text", [BOX, CLUB], ids=["box", "club"])
def test_centre_and_moments_are_those_that_drake_reads(tmp_path, text):
    tool, remarks = read(tmp_path, text)
    np.testing.assert_allclose(sum_weighed(tool), sum_inertia(tmp_path / "box.urdf"), rtol=1e-9, atol=1e-12)
    assert all("the file's centre and moments are used" in remark for remark in remarks)
    assert len(remarks) == len(tool.weighings)


def test_the_moment_at_the_grip_is_that_of_the_files_centre(tmp_path):
    read(tmp_path, BOX)
    off = tmp_path / "off.yaml"
    part = "{box: [0.1, 0.1, 0.1], position: [0.03, 0.02, 0], material: beech}"
    off.write_text(
        f"tools: [{{name: box off, mass: 1.0, components: [{part}], grips: {{grip: {{position: [0, 0, 0]}}}}}}]"
    )
    moments = [
        answer("rank", "hold", "--tools", path, "--json").content["options"][0]["grip_moment"]["mean"]
        for path in (tmp_path / "box.urdf", off)
    ]
    assert moments[0] == pytest.approx(moments[1], rel=0.01)
    assert moments[0] > 0.29


def test_guess_and_next_read_the_file_too(tmp_path):
    read(tmp_path, BOX)
    answered = answer("guess", tmp_path / "box.urdf")
    remark = "box.urdf: link box has its centre of mass 36.1 mm from that of its shape: the file's centre and moments"
    assert f"warning: {remark} are used" in answered.out
    content = answer("guess", tmp_path / "box.urdf", "--json").content
    assert content["remarks"] == [f"{remark} are used"]
    (box,) = content["expected"]
    assert [box["com"][axis]["mean"] for axis in "xyz"] == pytest.approx([0.03, 0.02, 0.0], abs=1e-4)
    assert box["inertia"]["Ixy"]["mean"] == pytest.approx(-0.0006, rel=0.01)


def test_what_no_such_shape_can_have_is_not_used(tmp_path):
    tool, (remark,) = read(tmp_path, BOX.replace("0.03 0.02 0", "0.3 0.02 0"))
    assert (
        "outside its shape, 301 mm from that of its shape: centre of mass and moments of its shape are used" in remark
    )
    np.testing.assert_allclose(tool.p_TTcm, 0.0, atol=1e-12)
    tool, (*_, remark) = read(tmp_path, BOX.replace('izz="0.0030"', 'izz="0.3"'))
    assert remark.endswith("centre of mass and moments of its shape are used")
    np.testing.assert_allclose(tool.p_TTcm, 0.0, atol=1e-12)


def test_nothing_is_said_of_a_file_that_agrees_with_its_shape(tmp_path):
    moments = " ".join(f'{name}="{0.01 / 6.0:.6f}"' for name in ("ixx", "iyy", "izz"))
    even = INERTIAL.replace("0.03 0.02 0", "0 0 0")
    even = even[: even.index("<inertia ")] + f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial>'
    assert read(tmp_path, BOX.replace(INERTIAL, even)).remarks == ()


def test_shapes_that_overlap_are_counted_once(tmp_path):
    tool, remarks = read(tmp_path, BOX.replace(SHAPE, SHAPE + SHAPE))
    assert len(tool.components) == 1
    assert "its parts share 50.0 % of their volume, which is counted once" in remarks[0]
    twice = BOX.replace("</robot>", f'<link name="other">{INERTIAL}{SHAPE}</link></robot>').replace(
        "</robot>", '<joint name="o" type="fixed"><parent link="box"/><child link="other"/></joint></robot>'
    )
    assert "link other: lies within other links" in refuse(read, tmp_path, twice)
