"""What a robot's file may say and leave out, and the mistakes that are refused."""

import math
from pathlib import Path

import pytest
from helpers.changed_files import change_file
from helpers.refusals import refuse
from helpers.robot_files import SDF, write_urdf

from affordance.exceptions import AffordanceError
from affordance.extensions.robots.importer import ImportOptions, extract_arm, parse_values, read_arm
from affordance.extensions.robots.report import list_dropped

TIP = ImportOptions("right_tool")
GOOD_LIMIT = 'lower="-2.5" upper="2.4" velocity="3" effort="40"'


def test_what_is_wrong_with_a_joint_of_another_limb_is_left_out_and_named(tmp_path: Path) -> None:
    """Limits of the neck, with which Drake would end the program whatever the arm, are left out and named."""
    good = 'type="revolute"><parent link="torso"/><child link="head"/>'
    path = write_urdf(tmp_path)
    text = path.read_text()
    start = text.index(GOOD_LIMIT, text.index(good))
    wrong = 'lower="3" upper="-3" velocity="-1" effort="-7"'
    path.write_text(text[:start] + wrong + text[start + len(GOOD_LIMIT) :])
    imported, _ = extract_arm(path, TIP)
    said = "limits of the joint neck, which is not part of the arm: it has position limits from 3 to -3 rad"
    assert any(note.startswith(said) for note in list_dropped(imported))


@pytest.mark.parametrize(
    ("written", "limits"),
    [
        ('upper="2.4" velocity="3"', (0.0, 2.4, 3.0)),  # a bound that is left out is 0, as in URDF
        ('lower="-inf" upper="inf" velocity="inf"', (-math.inf, math.inf, math.inf)),
    ],
)
def test_limits_may_be_infinite_or_left_out(tmp_path: Path, written: str, limits: tuple[float, ...]) -> None:
    """A continuous joint, the last one, has no position limits whatever its file says."""
    path = write_urdf(tmp_path, changes={'lower="-2.5" upper="2.4" velocity="3"': written})
    *others, last = read_arm(path, TIP).links
    assert (last.lower, last.upper) == (-math.inf, math.inf)
    assert [(link.lower, link.upper, link.velocity) for link in others] == [limits] * 3


def test_prefixes_that_were_never_declared_are_read(tmp_path: Path) -> None:
    """Undeclared XML prefixes, as simulators' own elements have them, are read."""
    block = '<gazebo reference="torso"><sensor:camera a:b="1" xml:lang="en"/></gazebo>'
    path = write_urdf(tmp_path, changes={"<gazebo/>": block})
    assert len(extract_arm(path, TIP)[0].links) == 4


def test_what_a_fixed_joint_says_of_its_axis_does_not_matter(tmp_path: Path) -> None:
    """A fixed joint with a zero axis, as CAD programs write it, and a robot without a name are read."""
    fixed = '<parent link="right_4"/><child link="right_tool"/><origin xyz="0.1 0 0" rpy="0.1 -0.2 0.05"/><axis xyz="'
    changes = {f"{fixed}0 1 0": f"{fixed}0 0 0", '<robot name="two_arms">': "<robot>"}
    imported, _ = extract_arm(write_urdf(tmp_path, changes=changes), TIP)
    assert not any("limits of the joint" in note for note in list_dropped(imported))


def test_values_for_joints_are_of_one_or_of_all() -> None:
    assert parse_values("--option", ["0.1", "elbow=0.2"], unit="N m") == {"": 0.1, "elbow": 0.2}
    assert parse_values("--option", ["0"], unit="N m") == {"": 0.0}


def test_a_joint_that_turns_nothing_is_refused(tmp_path: Path) -> None:
    text = write_urdf(tmp_path).read_text()
    for name in ("right_4", "right_finger", "right_thumb"):
        start = text.index(f'<link name="{name}">')
        end = text.index("</inertial>", start) + len("</inertial>")
        text = text[: start + len(f'<link name="{name}">')] + text[end:]
    path = tmp_path / "light.urdf"
    path.write_text(text)
    assert "joint right_j4: moves nothing that has inertia" in refuse(extract_arm, path, TIP, error=AffordanceError)
    assert extract_arm(path, ImportOptions("right_tool", rotor_inertia={"right_j4": 0.01}))[0].links[3].rotor_inertia


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {'lower="-2.5" upper="2.4" velocity="3" effort="40"': 'lower="-2.5" upper="2.4" velocity="3"'},
            "joint right_j1: has no torque limit (effort), must",
        ),
        (
            {'effort="40"': 'effort="0"'},
            "joint right_j1: has a torque limit (effort) of 0 N m, must be more than 0",
        ),
        ({'velocity="3"': 'velocity="0"'}, "joint right_j1: has a velocity limit of 0 rad/s, must be more"),
        ({'upper="2.4"': 'upper="fast"'}, "joint lift.limit.upper: is 'fast', must be a number"),
        ({'effort="40"': 'effort="much"'}, "joint lift.limit.effort: is 'much', must be a number"),
        ({'lower="-2.5" upper="2.4"': 'lower="1" upper="1"'}, "has position limits from 1 to 1 rad, must be a range"),
        (
            {'name="right_j3" type="revolute"': 'name="right_j3" type="prismatic"'},
            "joint right_j3: is of type prismatic",
        ),
        (
            {'<safety_controller k_velocity="1"/>': '<mimic joint="right_j2"/>'},
            "joint right_j3: follows right_j2 (mimic)",
        ),
        ({'<mass value="1.0"/>': '<mass value="-2"/>'}, "link right_1: has a mass of -2 kg with moments of inertia"),
        ({'<mass value="1.0"/>': '<mass value="0"/>'}, "link right_1: has a mass of 0 kg with moments of inertia"),
        ({'ixx="0.004"': 'ixx="0.4"'}, "has an inertia no solid can have (Ixx, Iyy, Izz 0.4, 0.005, 0.006 kg m^2)"),
        (
            {'rpy="0.1 0.2 0.3"': 'rpy="0.1 0.2"'},
            "link pelvis.inertial.origin.rpy: is '0.1 0.2', must be 3 finite numbers",
        ),
        ({"</robot>": ""}, "is not XML: "),
        (
            {"<robot ": "<machine ", "</robot>": "</machine>"},
            "begins with <machine>, must with <robot> (URDF), <sdf> or <muj",
        ),
        ({'joint name="neck"': 'joint name="lift"'}, "joint lift: appears twice"),
        (
            {'<parent link="right_1"/>': '<parent link="rigth_1"/>'},
            "joint right_j2.parent.link: is 'rigth_1', which is not a link of the file; did you mean 'right_1'?",
        ),
        ({'<child link="right_2"/>': ""}, "joint right_j2.child.link: is '', which is not a link of the file"),
        (
            {'<parent link="right_1"/>': '<parent link="right_2"/>'},
            "joint right_j2: connects the link right_2 to itself, must connect two",
        ),
        (
            {'<parent link="right_1"/>': '<parent link="right_3"/>'},
            "joint right_j3: connects right_2 and right_3, as joint right_j2 does, must be the only one",
        ),
        (
            {'<parent link="right_1"/>': '<parent link="right_4"/>'},
            "link right_2: is part of a loop of joints, must be connected to the robot's root",
        ),
        (
            {'name="right_j2" type="revolute"': 'name="right_j2" type="revolut"'},
            "joint right_j2.type: is 'revolut', must be one of revolute, continuous, prismatic, fixed, floating,"
            " planar; did you mean 'revolute'?",
        ),
        ({'velocity="3"': 'velocity="-3"'}, "joint right_j1: has a velocity limit of -3 rad/s, must be more than 0"),
        (
            {'lower="-2.5" upper="2.4"': 'lower="2.5" upper="-2.4"'},
            "joint right_j1: has position limits from 2.5 to -2.4 rad, must be a range",
        ),
        ({'effort="40"': 'effort="inf"'}, "joint right_j1: has no torque limit (effort), must"),
        ({'damping="0.2"': 'damping="-0.2"'}, "joint right_j2: has a damping of -0.2 N m s/rad, must be at least 0"),
        ({'<axis xyz="1 0.2 0"/>': '<axis xyz="0 0 0"/>'}, "joint right_j4: has an axis of zero length, must have a"),
        (
            {'<axis xyz="1 0.2 0"/>': '<axis xyz="1 nan 0"/>'},
            "joint right_j4.axis.xyz: is '1 nan 0', must be 3 finite",
        ),
        (
            {'<origin xyz="0.25 0 0.02"': '<origin xyz="inf 0 0"'},
            "origin.xyz: is 'inf 0 0', must be 3 finite numbers",
        ),
        ({'<link name="right_2">': '<link name="right_1">'}, "link right_1: appears twice"),
        (
            {'<parent link="left_1"/><child link="left_2"/>': '<parent link="left_1"/><child link="right_2"/>'},
            "link right_2: is the child of two joints, right_j2 and left_j2, must be of one",
        ),
        ({'effort="40"': 'effort="0"'}, "--effort VALUE sets limits (N m)"),
        (
            {'ixy="1e-4"': 'ixy="0.01"'},
            "has products of inertia no solid can have (Ixy, Ixz, Iyz 0.01, -0.0002, 0.0003 kg m^2, which"
            " make the principal moments -0.00",
        ),
    ],
)
def test_mistake_in_a_urdf_is_refused(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    path = write_urdf(tmp_path)
    change_file(path, *(text for change in changes.items() for text in change))
    assert said in refuse(extract_arm, path, TIP, error=AffordanceError)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<effort>20</effort>", "", "joint bend: has no torque limit (effort)"),
        ("<effort>20</effort>", "<effort>-1</effort>", "joint bend: has no torque limit (effort)"),
        ("<lower>-3</lower>", "<lower>nan</lower>", "joint pan.axis.limit.lower: is 'nan', must be a number"),
        ("<lower>-3</lower>", "<lower>4</lower>", "joint pan: has position limits from 4 to 3 rad, must be a range"),
        (
            "<velocity>2</velocity><effort>20",
            "<velocity>fast</velocity><effort>20",
            "joint bend.axis.limit.velocity: is",
        ),
        ("<friction>0.7</friction>", "<damping>-1</damping>", "joint pan: has a damping of -1 N m s/rad"),
        ("<xyz>0 0 1</xyz>", "<xyz>0 0 0</xyz>", "joint pan: has an axis of zero length"),
        ('<link name="wrist">', '<link name="upper">', "link upper: appears twice"),
        ("<velocity>2</velocity><effort>20", "<velocity>0</velocity><effort>20", "joint bend: has a velocity limit"),
        ("<mass>0.5</mass>", "<mass>half</mass>", "link wrist.inertial.mass: is 'half', must be a finite number"),
        ("<mass>0.5</mass>", "<mass>0</mass>", "link wrist: has a mass of 0 kg with moments of inertia"),
        (
            "\n<inertial><mass>0.5</mass><inertia><ixx>0.001</ixx><iyy>0.001</iyy><izz>0.001</izz></inertia></inertial>",
            "",
            "link wrist: has no <inertial>, for which SDF's default is 1 kg",
        ),
        (
            '<link name="foot">',
            '<include><uri>package://drake_models/ur3e/ur3e_cylinder.sdf</uri></include><link name="foot">',
            "include: is not supported, must be expanded",
        ),
        (
            '<link name="foot">',
            '<include><uri>file:///etc/passwd</uri></include><link name="foot">',
            "include: is not supported, must be expanded",
        ),
        (
            '<link name="foot">',
            '<include><uri>model://x</uri></include><link name="foot">',
            "include: is not supported, must be expanded",
        ),
        ('type="revolute"><parent>lower', 'type="ball"><parent>lower', "joint bend: is of type"),
    ],
)
def test_mistake_in_an_sdf_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SDF
    path = tmp_path / "bad.sdf"
    path.write_text(SDF.replace(old, new))
    assert said in refuse(extract_arm, path, ImportOptions("grip", base="foot"), error=AffordanceError)


ONE_JOINT = """<robot name="x"><link name="a"/><link name="b">{inertial}</link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="9"/></joint></robot>"""
HEAVY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


@pytest.mark.parametrize(
    ("inertial", "said"),
    [
        (
            "",
            "has no mass for any link of the arm, must have inertias (<inertial>); "
            "another file of this robot, such as one for a simulator, may have them",
        ),
        (HEAVY, "has its tip on its first joint's axis, must have a length"),
    ],
)
def test_arm_without_masses_or_length_is_refused(tmp_path: Path, inertial: str, said: str) -> None:
    path = tmp_path / "whole.urdf"
    path.write_text(ONE_JOINT.format(inertial=inertial))
    assert refuse(extract_arm, path, ImportOptions("b"), error=AffordanceError).startswith(f"{path}: {said}")
