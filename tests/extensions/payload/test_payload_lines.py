"""Lines for controllers, read back in the units that the makers' documentation states."""

import re

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from affordance.extensions.payload.payload_formats import PayloadSetting
from affordance.extensions.payload.payload_lines import format_payload, show_number

_MOMENTS = np.array([0.012, 0.015, 0.009, 0.001, -0.002, 0.0005])
_CENTRE = np.array([0.0123, -0.0456, 0.0789])
_SETTING = PayloadSetting(1.2345, _CENTRE, _MOMENTS)
_LINES = format_payload(_SETTING, "tool0")


def _read_numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"-?\d+\.?\d*", text)]


def _list_in_brackets(line: str) -> list[list[float]]:
    return [_read_numbers(each) for each in re.findall(r"\[([^\[\]]*)\]", line.partition("  #")[0])]


def test_a_ur_gets_moments_and_a_time_of_transition():
    line = _LINES["Universal Robots (URScript)"]
    centre, moments = _list_in_brackets(line)
    assert_allclose(centre, _CENTRE, atol=1e-5)
    assert_allclose(moments, _MOMENTS, atol=1e-6)
    assert line.partition("  #")[0].endswith(", 0.5)")


@pytest.mark.parametrize("name", ["UFACTORY xArm (Python)", "Doosan (DRL)"])
def test_millimetres_are_millimetres(name):
    assert_allclose(_list_in_brackets(_LINES[name])[0], 1e3 * _CENTRE, atol=0.01)
    assert "mm, in the frame 'tool0'" in _LINES[name]


def test_kuka_gets_principal_moments_and_the_angles_of_their_axes():
    line = _LINES["KUKA (KRL)"].partition("  ;")[0]
    m, x, y, z, a, b, c, jx, jy, jz = _read_numbers(line)
    assert m == 1.2345
    assert_allclose([x, y, z], 1e3 * _CENTRE, atol=0.01)
    R = Rotation.from_euler("ZYX", [a, b, c], degrees=True).as_matrix()  # about z, the new y, and the new x
    xx, yy, zz, xy, xz, yz = _MOMENTS
    assert_allclose(R @ np.diag([jx, jy, jz]) @ R.T, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], atol=3e-6)


@pytest.mark.parametrize("name", ["ROS 2 (ur_robot_driver)", "ROS 2 (franka_ros2)"])
def test_a_message_of_ros_is_yaml_in_si_units(name):
    message = yaml.safe_load(re.findall(r"'(\{.*?\})'  #", _LINES[name])[0])
    assert message.pop("mass") == 1.2345
    if "franka" in name:
        matrix = np.array(message.pop("load_inertia")).reshape(3, 3)
        assert_allclose(matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], _MOMENTS, atol=1e-6)
        assert_allclose(message.pop("center_of_mass"), _CENTRE, atol=1e-5)
    else:
        assert_allclose(list(message.pop("center_of_gravity").values()), _CENTRE, atol=1e-5)
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
