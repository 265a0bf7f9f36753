import json
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from helpers.generated_runs import PAYLOAD
from helpers.refusals import refuse
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia

from affordance.extensions.payload.payload_formats import PayloadSetting, read_payload
from affordance.extensions.payload.payload_lines import format_payload
from affordance.extensions.payload.posterior.marginals import describe_bodies
from affordance.objects.inertia import parameters_from_spatial_inertia, spatial_inertia_from_parameters

_VALUES = describe_bodies(PAYLOAD[None])[0]
_SETTING = PayloadSetting(_VALUES[0], _VALUES[1:4], _VALUES[4:])
_LINES = format_payload(_SETTING, "tool0")
_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]


def test_parameters_of_a_setting_are_those_of_the_body():
    assert_allclose(_SETTING.parameters, PAYLOAD, rtol=1e-12, atol=1e-15)
    point = _SETTING._replace(inertia=None)
    drake = SpatialInertia(point.mass, point.centre_of_mass, UnitInertia.PointMass(point.centre_of_mass))
    assert_allclose(point.parameters, parameters_from_spatial_inertia(drake), atol=1e-15)


def test_urdf_is_read_as_the_same_body():
    element = ET.fromstring(_LINES["URDF"])
    text = f"<robot name='r'><link name='l'>{ET.tostring(element, encoding='unicode')}</link></robot>"
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    body = plant.GetBodyByName("l")
    plant.WeldFrames(plant.world_frame(), body.body_frame())
    plant.Finalize()
    read = parameters_from_spatial_inertia(body.CalcSpatialInertiaInBodyFrame(plant.CreateDefaultContext()))
    assert_allclose(read, PAYLOAD, rtol=1e-4, atol=1e-6)


def test_drake_line_can_be_run():
    inertia = eval(
        _LINES["Drake (Python)"], {"SpatialInertia": SpatialInertia, "RotationalInertia": RotationalInertia}
    )
    assert_allclose(parameters_from_spatial_inertia(inertia), PAYLOAD, rtol=1e-4, atol=1e-6)


def test_libfranka_has_a_symmetric_matrix():
    numbers = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", _LINES["Franka (libfranka)"].split("//")[0])
    matrix = np.array([float(number) for number in numbers[4:]]).reshape(3, 3)
    assert_allclose(matrix, matrix.T)
    assert (np.linalg.eigvalsh(matrix) > 0.0).all()


def test_urscript_has_moments_about_the_centre_of_mass():
    line = _LINES["Universal Robots (URScript)"]
    mass, *rest = [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", line.split("#")[0])]
    assert_allclose(mass, PAYLOAD[0], rtol=1e-4)
    assert_allclose(rest[:3], _CENTRE, atol=1e-5)
    assert_allclose(rest[3], PAYLOAD[4] - mass * (_CENTRE[1] ** 2 + _CENTRE[2] ** 2), rtol=1e-3)


def test_a_payload_without_moments_is_marked():
    lines = format_payload(_SETTING._replace(inertia=None), "tool0")
    for name in ("Universal Robots (URScript)", "Franka (libfranka)", "KUKA (KRL)", "URDF", "Drake (Python)"):
        assert "in the frame 'tool0'; moments not seen: a point mass" in lines[name]


def test_a_guessed_centre_of_mass_is_marked_in_every_line():
    for line in format_payload(_SETTING._replace(is_centre_guessed=True), "tool0").values():
        assert "in the frame 'tool0'; centre of mass not seen" in line


@pytest.mark.parametrize("name", ["a\nset_tcp(p[1,0,0,0,0,0])", "a\r", "a-->b", "a--b", "a\u2028b", "\u202ea", "a\\"])
def test_the_name_of_a_frame_ends_neither_line_nor_comment(name, tmp_path):
    """The name may come from the file of a stranger, and the lines go into a robot's program."""
    lines = format_payload(_SETTING, name)
    for line in lines.values():
        assert line.isprintable()
        assert not line.endswith("\\")
    assert len(list(ET.fromstring(f"<link>{lines['URDF']}</link>").iter())) == 5
    program = _write(tmp_path, "a.script", lines["Universal Robots (URScript)"])
    assert_allclose(read_payload(program).parameters, PAYLOAD, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_a_payload_in_another_frame_is_that_of_drake(seed):
    rng = np.random.default_rng(seed)
    X_FT = RigidTransform(RotationMatrix(RollPitchYaw(rng.uniform(-2.0, 2.0, 3))), rng.uniform(-0.5, 0.5, 3))
    turned = spatial_inertia_from_parameters(PAYLOAD).ReExpress(X_FT.rotation())
    expected = parameters_from_spatial_inertia(turned.Shift(-X_FT.translation()))
    assert_allclose(_SETTING.express(X_FT.GetAsMatrix4()).parameters, expected, rtol=1e-9, atol=1e-12)
    point = _SETTING._replace(inertia=None, is_centre_guessed=True).express(X_FT.GetAsMatrix4())
    assert_allclose(point.centre_of_mass, X_FT @ _CENTRE, atol=1e-12)
    assert point.inertia is None
    assert point.is_centre_guessed


def _write(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", ["Universal Robots (URScript)", "URDF"])
def test_lines_are_read_as_they_were_written(tmp_path, name):
    path = _write(tmp_path, "line.urdf" if name == "URDF" else "program.script", _LINES[name])
    assert_allclose(read_payload(path).parameters, PAYLOAD, rtol=1e-4, atol=1e-6)


def test_files_of_makers_and_our_own_are_one_payload(tmp_path):
    m, c = float(_SETTING.mass), [float(value) for value in _SETTING.centre_of_mass]
    moments = xx, yy, zz, xy, xz, yz = [float(value) for value in _SETTING.inertia]
    matrix = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    hand = {
        "mass": m,
        "centerOfMass": c,
        "transformation": list(np.eye(4).ravel()),
        "inertia": list(np.ravel(matrix)),
    }
    ours = f"mass: {m}\ncom: {c}\ninertia: {moments}\n"
    for path in (
        _write(tmp_path, "hand.json", json.dumps(hand)),
        _write(tmp_path, "nested.json", json.dumps({"endEffector": hand})),
        _write(tmp_path, "ours.yaml", ours),
    ):
        assert_allclose(read_payload(path).parameters, PAYLOAD, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "mass", "centre"),
    [
        ("set_payload(1.5)\n  set_payload(0.73, [0.0, 0.0, 0.06])  # camera\n", 0.73, [0.0, 0.0, 0.06]),
        ("set_payload(5)\nset_payload_cog([0.01, 0, 0])\n# set_target_payload(2, [0, 0, 1])", 5.0, [0.01, 0.0, 0.0]),
    ],
)
def test_the_last_call_of_a_program_counts_and_comments_set_nothing(tmp_path, text, mass, centre):
    setting = read_payload(_write(tmp_path, "a.urscript", text))
    assert (setting.mass, list(setting.centre_of_mass), setting.inertia) == (mass, centre, None)


def test_axes_of_an_inertial_are_turned(tmp_path):
    text = (
        "<link><inertial><mass value='2'/><origin xyz='0 0 0.1' rpy='0 0 1.5707963267948966'/>"
        "<inertia ixx='0.01' iyy='0.02' izz='0.025' ixy='0' ixz='0' iyz='0'/></inertial></link>"
    )
    assert_allclose(read_payload(_write(tmp_path, "l.urdf", text)).inertia, [0.02, 0.01, 0.025, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("moments", ["[-1, -1, -1]", "[1, 1, 3]", "[0.1, 0.1, 0.1, 0.5, 0, 0]"])
def test_moments_that_no_body_has_are_refused(tmp_path, moments):
    path = _write(tmp_path, "a.yaml", f"mass: 1\ninertia: {moments}\n")
    assert "inertia: has principal moments" in refuse(read_payload, path)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.yaml", "mass: -1\n", "a.yaml: mass: is -1, must be from 0 to 1000"),
        ("a.yaml", "mas: 1\n", "mass: is missing; is 'mas' misspelt?"),
        ("a.yaml", "mass: 1\ninertia: [1, 2, 3, 4]\n", "inertia: has 4 numbers, must have 3 or 6"),
        ("a.json", "{}", "mass: is missing"),
        ("a.json", '{"mass": 1, "inertia": [1, 2]}', "inertia: is [1, 2], must be a list with at least 9 entries"),
        ("a.script", "movej(q)", "has no line set_target_payload"),
        ("a.script", "set_payload(1, [0, 0])", "set_target_payload: must have three coordinates"),
        ("a.urdf", "<robot><link/></robot>", "inertial: appears 0 times"),
        ("a.urdf", "<inertial><mass value='x'/></inertial>", "value: is 'x', must be 1 numbers"),
        ("a.urdf", "<inertial/>", "inertial: has no mass"),
        ("a.doc", "1", "a.doc: has the unknown type '.doc', must be .yaml"),
    ],
)
def test_file_that_holds_no_payload_is_refused(tmp_path, name, text, said):
    assert said in refuse(read_payload, _write(tmp_path, name, text))
