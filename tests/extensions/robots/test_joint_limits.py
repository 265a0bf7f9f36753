"""Limits of joints by robots' files and by ``joint_limits.yaml``."""

import numpy as np
import pytest
from helpers.generated_runs import build_robot
from helpers.refusals import refuse

from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.joint_limits import limit_joints
from affordance.extensions.robots.kept import import_arm
from affordance.extensions.robots.recorded_arm import load_robot


@pytest.fixture
def robot(tmp_path):
    return build_robot(tmp_path)


def _write(tmp_path, text):
    path = tmp_path / "joint_limits.yaml"
    path.write_text("joint_limits:\n" + text)
    return path


def test_the_lower_of_two_limits_counts_if_it_is_on(robot, tmp_path):
    first, second, *_ = robot.joint_names
    text = f"  {first}: {{max_acceleration: 2.0, max_velocity: 1000.0, max_jerk: 5}}\n"
    text += f"  {second}: {{max_acceleration: 0, has_acceleration_limits: false, max_velocity: 0.25}}\n"
    found = limit_joints(robot, _write(tmp_path, text))
    np.testing.assert_array_equal(found.acceleration_limits[:3], [2.0, np.inf, np.inf])
    assert found.velocity_limits[0] == robot.velocity_limits[0]
    assert found.velocity_limits[1] == 0.25


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("  other: {max_acceleration: 2.0}\n", "joint_limits: names none of the joints "),
        ("  NAME: {max_acceleration: 0}\n", ".max_acceleration: is 0, must be more than 0"),
        ("  NAME: {max_acceleration: -1}\n", ".max_acceleration: is -1"),
        ("  NAME: {max_velocity: fast}\n", ".max_velocity: is 'fast'"),
    ],
)
def test_limits_that_no_joint_has_are_refused(robot, tmp_path, text, said):
    path = _write(tmp_path, text.replace("NAME", robot.joint_names[0]))
    assert said in refuse(limit_joints, robot, path)


@pytest.mark.parametrize(
    ("attributes", "limit"),
    [
        ('acceleration="4"', 4.0),
        ('acceleration="4" deceleration="3"', 3.0),
        ('drake:acceleration="5"', 5.0),
        ('acceleration="0"', np.inf),
        ('acceleration="-2"', np.inf),
        ("", np.inf),
    ],
)
def test_limits_of_acceleration_are_those_of_the_file_and_of_its_import(robot, tmp_path, attributes, limit):
    path = tmp_path / "limited.urdf"
    path.write_text((tmp_path / "robot.urdf").read_text().replace("<limit ", f"<limit {attributes} "))
    np.testing.assert_array_equal(load_robot(path, "flange").acceleration_limits, np.full(6, limit))
    import_arm(path, ImportOptions("flange", out_axis="y"), tmp_path / "six", with_meshes=False, fits_tasks=False)
    np.testing.assert_array_equal(load_robot(tmp_path / "six").acceleration_limits, np.full(6, limit))


def test_a_limit_of_acceleration_must_be_a_number(robot, tmp_path):
    path = tmp_path / "limited.urdf"
    path.write_text((tmp_path / "robot.urdf").read_text().replace("<limit ", '<limit acceleration="fast" '))
    assert ".limit.acceleration: is 'fast', must be a number" in refuse(load_robot, path, "flange")
