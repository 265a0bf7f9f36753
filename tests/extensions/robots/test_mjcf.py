"""Joints and torque limits of an MJCF model, as MuJoCo compiles it, and files that it includes."""

import re
from pathlib import Path

import pytest
from helpers.refusals import refuse
from helpers.robot_files import MJCF

from affordance.exceptions import AffordanceError, BadValueError
from affordance.extensions.robots.importer import ImportOptions, extract_arm, read_arm
from affordance.extensions.robots.reduced_arm import ReducedArm

TIP = ImportOptions("grip_site")


def read(folder: Path, *changes: tuple[str, str], options: ImportOptions = TIP) -> ReducedArm:
    """Reads the arm of a model in which texts are exchanged."""
    text = MJCF
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "reacher.xml"
    path.write_text(text)
    return read_arm(path, options)


def list_efforts(arm: ReducedArm) -> list[float]:
    return [link.effort for link in arm.links]


A2 = 'joint="a2" ctrlrange="-9 9"'


# Limits of torque of a1 to a4, whose gears are 3, 2, 2, 3; values as found in the dynamics of MuJoCo 3.17.
@pytest.mark.parametrize(
    ("old", "new", "efforts"),
    [
        # The actuators of a class share their attributes, whatever they are called in it; a class inherits.
        ('<motor gear="2"/>', '<general gear="2" forcerange="-3 3"/>', [9, 6, 14, 9]),
        ('<motor gear="2"/>', '<position gear="2" forcerange="-3 4" kp="9"/>', [9, 6, 14, 9]),
        # The last of them in a class counts.
        ('gear="2"/>', 'gear="2" forcerange="-3 3"/><general forcerange="-4 4"/>', [12, 8, 14, 12]),
        # Control and force are both limited.
        (A2, f'{A2} forcerange="-100 100"', [30, 18, 14, 30]),
        (A2, f'{A2} forcerange="-5 6"', [30, 10, 14, 30]),
        # A limit can be switched off; then the other one holds.
        (A2, f'{A2} forcerange="-1 1" forcelimited="false"', [30, 18, 14, 30]),
        # Limit on the sum of all actuators of a joint.
        ('name="a2" axis="0 1 0"', 'name="a2" axis="0 1 0" actuatorfrcrange="-500 500"', [30, 18, 14, 30]),
        ('name="a2" axis="0 1 0"', 'name="a2" axis="0 1 0" actuatorfrcrange="-4 5"', [30, 4, 14, 30]),
        # A general actuator multiplies its control, unless it feeds back.
        (f"<motor {A2}", '<general joint="a2" ctrlrange="-1 1" gainprm="7"', [30, 14, 14, 30]),
        (
            f"<motor {A2}",
            '<general joint="a2" ctrlrange="-1 1" gainprm="7" biastype="affine" biasprm="0 -70" forcerange="-20 20"',
            [30, 40, 14, 30],
        ),
        # Signs of gear and gain say which way it turns.
        ('gear="2"/>', 'gear="-2"/>', [30, 18, 14, 30]),
        (f"<motor {A2}", '<general joint="a2" ctrlrange="-1 1" gainprm="-7"', [30, 14, 14, 30]),
        # Two actuators of a joint add up.
        ("<actuator>", '<actuator><motor joint="a2" ctrlrange="-1 1"/>', [30, 20, 14, 30]),
    ],
)
def test_torque_is_limited_by_all_that_limits_it(tmp_path: Path, old: str, new: str, efforts: list[int]) -> None:
    assert list_efforts(read(tmp_path, (old, new))) == efforts


def test_joint_has_the_torque_of_the_weaker_direction_and_the_armature_of_its_class(tmp_path: Path) -> None:
    arm = read(tmp_path)
    # All actuators share the gear of 2 that the main class gives to motors.
    assert list_efforts(arm) == [30.0, 18.0, 14.0, 30.0]
    assert [link.rotor_inertia for link in arm.links] == [0.05, 0.05, 0.05, 0.01]
    assert [link.damping for link in arm.links] == [0.1] * 4
    assert arm.X_LH.translation()[0] == pytest.approx(0.1)
    assert {link.velocity for link in arm.links} == {float("inf")}


def test_classes_inherit_from_those_they_are_nested_in_and_the_elements_own_class_comes_first(tmp_path: Path) -> None:
    nested = '<default class="weak"><joint armature="0.7"/></default></default></default>'
    arm = read(
        tmp_path,
        ("</default></default>", nested),
        ('name="second" pos="0.3 0 0"', 'name="second" childclass="weak" pos="0.3 0 0"'),
        ('joint name="a4" axis', 'joint name="a4" class="main" axis'),
        (' armature="0.01"/>', "/>"),
    )
    assert [link.rotor_inertia for link in arm.links] == [0.05, 0.05, 0.7, 0.02]
    assert [link.damping for link in arm.links] == [0.1] * 4
    # The range is of the class "strong", of which the last joint is not.
    assert [link.upper for link in arm.links] == [2.0, 2.0, 2.0, float("inf")]


@pytest.mark.parametrize(
    ("attribute", "limits"),
    [
        ('limited="false"', (float("-inf"), float("inf"))),
        ('limited="true"', (-2.0, 2.0)),
        # MuJoCo's angles count from the reference, the arm's from the pose that the file draws.
        ('ref="0.5"', (-2.5, 1.5)),
    ],
)
def test_limits_of_joints_are_those_of_the_compiler(
    tmp_path: Path, attribute: str, limits: tuple[float, float]
) -> None:
    arm = read(tmp_path, ('range="-2 2"', f'range="-2 2" {attribute}'))
    assert {(link.lower, link.upper) for link in arm.links} == {limits}


def test_a_site_that_is_called_as_its_body_is_told_apart(tmp_path: Path) -> None:
    change = 'site name="grip_site"', 'site name="third"'
    assert read(tmp_path, change, options=ImportOptions("third")).X_LH.translation()[0] == 0.0
    assert read(tmp_path, change, options=ImportOptions("third_site")).X_LH.translation()[0] == pytest.approx(0.1)


def test_bodies_and_joints_without_names_get_some(tmp_path: Path) -> None:
    arm = read(
        tmp_path,
        ('body name="second"', "body"),
        ('<joint name="a3" axis="0 1 0"/>', '<joint axis="0 1 0" actuatorfrcrange="-5 5"/>'),
        ('<position joint="a3" forcerange="-8 7"/>', ""),
    )
    assert [(link.name, link.joint) for link in arm.links][2] == ("body", "body_joint")
    assert list_efforts(arm) == [30.0, 18.0, 5.0, 30.0]


ACTUATORS = MJCF[MJCF.index("<actuator>") : MJCF.index("</mujoco>")]


def write_parts(folder: Path, **files: str) -> Path:
    """Writes a model whose actuators and defaults are included from files of the given content."""
    start, end = MJCF.index("<default>"), MJCF.index("<asset>")
    main = MJCF[:start] + '<include file="parts/defaults.xml"/>' + MJCF[end:]
    main = main.replace(ACTUATORS, '<include file="motors.xml"/>')
    content = {
        "reacher.xml": main,
        "parts/defaults.xml": f"<mujocoinclude>{MJCF[start:end]}</mujocoinclude>",
        "motors.xml": f"<mujoco>{ACTUATORS}</mujoco>",
        **files,
    }
    for name, text in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder / "reacher.xml"


def test_included_files_are_part_of_the_model(tmp_path: Path) -> None:
    found = read_arm(write_parts(tmp_path / "split"), TIP)
    assert list_efforts(found) == list_efforts(read(tmp_path))
    assert [path.name for path in found.tree.description.sources] == ["defaults.xml", "motors.xml"]


INCLUDE = '<mujoco><include file="{}"/></mujoco>'


@pytest.mark.parametrize(
    ("motors", "said"),
    [
        (INCLUDE.format("../secret.xml"), "must be a file in the model's own folder"),
        (INCLUDE.format("/etc/hosts"), "motors.xml: include: names '/etc/hosts', must"),
        ("<mujoco><include/></mujoco>", "include: names '', must be a file"),
        (INCLUDE.format("motors.xml"), "names 'motors.xml' a second time"),
        (INCLUDE.format("reacher.xml"), "names 'reacher.xml' a second time"),
        (INCLUDE.format("none.xml"), "none.xml: cannot be read"),
        (INCLUDE.format("0.xml"), "nests deeper than 8 files"),
        ("<robot/>", "motors.xml: is of <robot>, must be of <mujoco> or <mujocoinclude>"),
        ("<mujoco>", "motors.xml: line 1, column 9: is not XML"),
    ],
)
def test_an_include_stays_in_the_models_folder_and_comes_to_an_end(tmp_path: Path, motors: str, said: str) -> None:
    (tmp_path / "secret.xml").write_text(f"<mujoco>{ACTUATORS}</mujoco>")
    nested = {f"{k}.xml": INCLUDE.format(f"{k + 1}.xml") for k in range(20)}
    with pytest.raises(BadValueError, match=re.escape(said)):
        read_arm(write_parts(tmp_path / "model", **nested, **{"motors.xml": motors}), TIP)


def test_a_link_of_the_models_folder_does_not_lead_out_of_it(tmp_path: Path) -> None:
    (tmp_path / "secret.xml").write_text(f"<mujoco>{ACTUATORS}</mujoco>")
    path = write_parts(tmp_path / "model")
    (path.parent / "motors.xml").unlink()
    (path.parent / "motors.xml").symlink_to(tmp_path / "secret.xml")
    assert "must be a file in the model's own folder" in refuse(read_arm, path, TIP)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'forcerange="-8 7"',
            'forcerange="-8 7" forcelimited="false"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        (
            'forcerange="-8 7"',
            'ctrlrange="-1 1" kp="50"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        (
            'forcerange="-8 7"',
            'forcerange="0 0"',
            "joint a3: has no torque limit (effort), must have one of more than 0 N m; --effort a3=VALUE sets",
        ),
        ('forcerange="-8 7"', "", "joint a3: has no torque limit (effort)"),
        (
            '<inertial pos="0.05 0 0" mass="0.4" diaginertia="0.001 0.0012 0.0013"/>',
            '<geom type="mesh" mesh="m"/>',
            "link third: derives its inertia from the mesh m, must have an <inertial>",
        ),
        ('mass="0.4"', 'mass="0"', "link third: has a mass of 0 kg"),
        ('diaginertia="0.001 0.0012 0.0013"', 'diaginertia="0 0 0"', "gives an arm that Drake rejects: "),
        ('range="-2 2"', 'range="2 -2"', "joint a1: has position limits from 2 to -2 rad, must be a range"),
        (
            '<joint damping="0.1"',
            '<joint damping="-1"',
            "joint a1: has a damping of -1 N m s/rad, must be at least 0",
        ),
        ('axis="0 1 0.1"', 'axis="0 0 0"', "joint a4: has an axis of zero length"),
        ('forcerange="-8 7"', 'forcerange="8 -7"', "actuator a3.forcerange: is from 8 to -7, must rise"),
        ('name="a2"', 'name="a1"', "joint a1: appears twice"),
        ('body name="second"', 'body name="first"', "body first: appears twice"),
        (
            'class="strong" joint="a4"',
            'class="strog" joint="a4"',
            "motor.class: is 'strog', must be one of main, strong; did you mean 'strong'?",
        ),
        (
            'joint="a3"',
            'joint="aa3"',
            "actuator aa3.joint: is 'aa3', which is not a joint of the file; did you mean 'a3'?",
        ),
        (
            "<worldbody>",
            '<compiler angle="radians"/><worldbody>',
            "compiler.angle: is 'radians', must be one of radian, degree; did you mean 'radian'?",
        ),
    ],
)
def test_mistake_in_an_mjcf_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in MJCF
    path = tmp_path / "bad.xml"
    path.write_text(MJCF.replace(old, new))
    assert said in refuse(extract_arm, path, TIP, error=AffordanceError)
