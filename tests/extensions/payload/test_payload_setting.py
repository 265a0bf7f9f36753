"""Payload settings: read from a file, turned into other frames, and written in the units of makers' documents."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import yaml
from helpers.generated_runs import PAYLOAD
from helpers.refusals import refuse
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RotationalInertia, SpatialInertia, UnitInertia
from scipy.spatial.transform import Rotation

from affordance.extensions.payload.payload_setting import PayloadSetting, format_payload, read_payload, show_number
from affordance.extensions.payload.posterior.payload_belief import describe_bodies
from affordance.objects.inertia import parameters_from_spatial_inertia, spatial_inertia_from_parameters

_VALUES = describe_bodies(PAYLOAD[None])[0]
_SETTING = PayloadSetting(_VALUES[0], _VALUES[1:4], _VALUES[4:])
_LINES = format_payload(_SETTING, "tool0")
_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]
_SIX = np.array([0.012, 0.015, 0.009, 0.001, -0.002, 0.0005])
_PLACE = np.array([0.0123, -0.0456, 0.0789])
_OTHER = format_payload(PayloadSetting(1.2345, _PLACE, _SIX), "tool0")


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
def test_the_name_of_a_frame_ends_neither_line_nor_comment(name):
    """The name may come from the file of a stranger, and the lines go into a robot's program."""
    lines = format_payload(_SETTING, name)
    for line in lines.values():
        assert line.isprintable()
        assert not line.endswith("\\")
    assert len(list(ET.fromstring(f"<link>{lines['URDF']}</link>").iter())) == 5


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


def test_a_file_is_the_payload_that_it_states(tmp_path):
    moments = [float(value) for value in _SETTING.inertia]
    text = f"mass: {_SETTING.mass}\ncom: {[float(value) for value in _SETTING.centre_of_mass]}\ninertia: {moments}\n"
    assert_allclose(read_payload(_write(tmp_path, "ours.yaml", text)).parameters, PAYLOAD, rtol=1e-9, atol=1e-12)


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
    ],
)
def test_file_that_holds_no_payload_is_refused(tmp_path, name, text, said):
    assert said in refuse(read_payload, _write(tmp_path, name, text))


def _read_numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"-?\d+\.?\d*", text)]


def _list_in_brackets(line: str) -> list[list[float]]:
    return [_read_numbers(each) for each in re.findall(r"\[([^\[\]]*)\]", line.partition("  #")[0])]


def test_a_ur_gets_moments_and_a_time_of_transition():
    line = _OTHER["Universal Robots (URScript)"]
    centre, moments = _list_in_brackets(line)
    assert_allclose(centre, _PLACE, atol=1e-5)
    assert_allclose(moments, _SIX, atol=1e-6)
    assert line.partition("  #")[0].endswith(", 0.5)")


@pytest.mark.parametrize("name", ["UFACTORY xArm (Python)", "Doosan (DRL)"])
def test_millimetres_are_millimetres(name):
    assert_allclose(_list_in_brackets(_OTHER[name])[0], 1e3 * _PLACE, atol=0.01)
    assert "mm, in the frame 'tool0'" in _OTHER[name]


def test_kuka_gets_principal_moments_and_the_angles_of_their_axes():
    line = _OTHER["KUKA (KRL)"].partition("  ;")[0]
    m, x, y, z, a, b, c, jx, jy, jz = _read_numbers(line)
    assert m == 1.2345
    assert_allclose([x, y, z], 1e3 * _PLACE, atol=0.01)
    R = Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix()  # about z, the new y, and the new x
    xx, yy, zz, xy, xz, yz = _SIX
    assert_allclose(R @ np.diag([jx, jy, jz]) @ R.T, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], atol=3e-6)


@pytest.mark.parametrize("name", ["ROS 2 (ur_robot_driver)", "ROS 2 (franka_ros2)"])
def test_a_message_of_ros_is_yaml_in_si_units(name):
    message = yaml.safe_load(re.findall(r"'(\{.*?\})'  #", _OTHER[name])[0])
    assert message.pop("mass") == 1.2345
    if "franka" in name:
        matrix = np.array(message.pop("load_inertia")).reshape(3, 3)
        assert_allclose(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], _SIX, atol=1e-6)
        assert_allclose(message.pop("center_of_mass"), _PLACE, atol=1e-5)
    else:
        assert_allclose(list(message.pop("center_of_gravity").values()), _PLACE, atol=1e-5)
    assert not message


def test_no_line_has_a_negative_zero_or_a_power_of_ten():
    tiny = PayloadSetting(0.5, np.array([-1e-7, 1e-6, 0.1]), np.array([1e-7, 1e-7, 1e-7, -1e-9, 0.0, 0.0]))
    for name, line in format_payload(tiny, "tool0").items():
        if name not in ("URDF", "Drake (Python)"):  # which read them
            assert not re.search(r"-0(\.0*)?(?![.\d])|\de-", line), line


@pytest.mark.parametrize(
    ("value", "text"), [(1e-5, "0"), (-1e-5, "0"), (0.1, "0.1"), (100.0, "100"), (0.12344, "0.1234")]
)
def test_numbers_are_short_and_never_powers_of_ten(value, text):
    assert show_number(value, 4) == text
