"""Every mistake in a robot's file, or in what is said of it, is one line that names file or option and place."""

import math
import re
from pathlib import Path

import pytest
from helpers.robot_files import MJCF, SDF, write_urdf

from affordance.exceptions import AffordanceError
from affordance.robots.importer import ImportOptions, extract_arm, parse_spread
from affordance.robots.report import list_dropped

TIP = ImportOptions("right_tool")
GOOD_LIMIT = 'lower="-2.5" upper="2.4" velocity="3" effort="40"'


def refuse(path: Path, options: ImportOptions = TIP) -> str:
    with pytest.raises(AffordanceError) as caught:
        extract_arm(path, options)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {GOOD_LIMIT: 'lower="-2.5" upper="2.4" velocity="3"'},
            "joint right_j1: has no limit of torque (effort), must",
        ),
        (
            {'effort="40"': 'effort="0"'},
            "joint right_j1: has a limit of torque (effort) of 0 N m, must be more than 0",
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
            {"<robot ": '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', "<gazebo/>": "<xacro:macro/>"},
            "is a xacro",
        ),
        (
            {"<robot ": '<robot xmlns:xacro="http://wiki.ros.org/xacro" ', "<gazebo/>": "<xacro:macro/>"},
            "is a xacro",
        ),
        ({"<gazebo/>": "<xacro:include/>"}, "is a xacro"),
        (
            {"<robot ": "<machine ", "</robot>": "</machine>"},
            "is of <machine>, must be of <robot> (URDF), <sdf> or <muj",
        ),
        ({'joint name="neck"': 'joint name="lift"'}, "joint lift: is there twice"),
        (
            {'<parent link="right_1"/>': '<parent link="rigth_1"/>'},
            "joint right_j2.parent.link: is 'rigth_1', which is no link of the file; did you mean 'right_1'?",
        ),
        (
            {'<child link="right_2"/>': ""},
            "joint right_j2.child.link: is '', which is no link of the file",
        ),
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
            "joint right_j2.type: is 'revolut', must be one of revolute, continuous, prismatic, fixed, floating, "
            "planar; did you mean 'revolute'?",
        ),
        # Over these Drake would end the program, or say what only those understand who wrote it.
        ({'velocity="3"': 'velocity="-3"'}, "joint right_j1: has a velocity limit of -3 rad/s, must be more than 0"),
        (
            {'lower="-2.5" upper="2.4"': 'lower="2.5" upper="-2.4"'},
            "joint right_j1: has position limits from 2.5 to -2.4 rad, must be a range",
        ),
        ({'effort="40"': 'effort="inf"'}, "joint right_j1: has no limit of torque (effort), must"),
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
        ({'<link name="right_2">': '<link name="right_1">'}, "link right_1: is there twice"),
        (
            {'<parent link="left_1"/><child link="left_2"/>': '<parent link="left_1"/><child link="right_2"/>'},
            "link right_2: is the child of two joints, right_j2 and left_j2, must be of one",
        ),
        (
            {'ixy="1e-4"': 'ixy="0.01"'},
            "has products of inertia no solid can have (Ixy, Ixz, Iyz 0.01, -0.0002, 0.0003 kg m^2, which make the "
            "principal moments -0.00",
        ),
    ],
)
def test_a_bad_urdf_is_refused_in_one_line(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    path = write_urdf(tmp_path, changes=changes)
    # The two arms share their texts; the left one is made well again where Drake itself would stumble over it.
    text = refuse(path)
    assert said in text
    assert str(path) in text


def test_what_is_wrong_with_a_joint_of_another_limb_is_left_out_and_named(tmp_path: Path) -> None:
    """As over the neck of this robot Drake would end the program, whatever its arm."""
    good = 'type="revolute"><parent link="torso"/><child link="head"/>'
    path = write_urdf(tmp_path)
    text = path.read_text()
    start = text.index(GOOD_LIMIT, text.index(good))
    wrong = 'lower="3" upper="-3" velocity="-1" effort="-7"'
    path.write_text(text[:start] + wrong + text[start + len(GOOD_LIMIT) :])
    imported = extract_arm(path, TIP)
    said = "limits of the joint neck, which is not part of the arm: it has position limits from 3 to -3 rad"
    assert any(note.startswith(said) for note in list_dropped(imported))


def test_a_joint_without_end_has_no_limits_whatever_its_file_says(tmp_path: Path) -> None:
    """By the rules of URDF; where one bound of another joint is left out, it is 0."""
    path = write_urdf(tmp_path, changes={'lower="-2.5" upper="2.4"': 'upper="2.4"'})
    *others, last = extract_arm(path, TIP).arm.links
    assert (last.lower, last.upper) == (-math.inf, math.inf)
    assert [(link.lower, link.upper) for link in others] == [(0.0, 2.4)] * 3


def test_infinite_limits_are_none(tmp_path: Path) -> None:
    limits = {'lower="-2.5" upper="2.4" velocity="3"': 'lower="-inf" upper="inf" velocity="inf"'}
    for link in extract_arm(write_urdf(tmp_path, changes=limits), TIP).arm.links:
        assert (link.lower, link.upper, link.velocity) == (-math.inf, math.inf, math.inf)


def test_prefixes_that_were_never_declared_are_read(tmp_path: Path) -> None:
    """As simulators' own elements have them."""
    block = '<gazebo reference="torso"><sensor:camera a:b="1" xml:lang="en"/></gazebo>'
    path = write_urdf(tmp_path, changes={"<gazebo/>": block})
    assert len(extract_arm(path, TIP).arm.links) == 4
    path = write_urdf(tmp_path, changes={"<gazebo/>": block.replace("</gazebo>", "")})
    assert "is not XML: mismatched tag" in refuse(path)


def test_what_a_fixed_joint_says_of_its_axis_does_not_matter(tmp_path: Path) -> None:
    """As CAD programs write it; nor does a robot need a name."""
    fixed = '<parent link="right_4"/><child link="right_tool"/><origin xyz="0.1 0 0" rpy="0.1 -0.2 0.05"/><axis xyz="'
    changes = {f"{fixed}0 1 0": f"{fixed}0 0 0", '<robot name="two_arms">': "<robot>"}
    imported = extract_arm(write_urdf(tmp_path, changes=changes), TIP)
    assert not any("limits of the joint" in note for note in list_dropped(imported))


def test_a_robot_without_masses_is_refused(tmp_path: Path) -> None:
    """As many files for planning are, which say where links are and no more."""
    path = write_urdf(tmp_path)
    path.write_text(re.sub(r"<inertial>.*?</inertial>", "", path.read_text()))
    assert refuse(path).endswith(
        "two_arms.urdf: has no mass for any link of the arm, must have inertias (<inertial>)"
    )


def test_mimic_and_prismatic_end_a_chain_but_not_one_that_names_its_base(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    assert extract_arm(path, TIP).arm.base == "torso"
    assert "joint lift: is of type prismatic, must be revolute" in refuse(path, ImportOptions("right_tool", "pelvis"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (ImportOptions("right_tol"), "--tip: is 'right_tol', which"),
        (ImportOptions("right_tol"), "nearest: right_tool"),
        (ImportOptions("right_j2"), "is a joint of"),
        (ImportOptions("right_j2"), "must be a link: right_2?"),
        (ImportOptions("pelvis"), "--tip: is 'pelvis', with no joint that turns"),
        (ImportOptions("right_tool", "left_1"), "--base: is 'left_1', which is not above right_tool, must be of"),
        (ImportOptions("right_tool", "tors"), "nearest: torso"),
        (ImportOptions("right_tool", out_axis="up"), "--out-axis: is 'up', must be one of x, y, z, -x, -y, -z"),
        (ImportOptions("right_tool", posture={"nek": 0.1}), "--posture: names 'nek', which is no moving joint of"),
        (ImportOptions("right_tool", posture={"neck": 7.0}), "--posture: puts neck at 7, must be from -2.5 to 2.4"),
        (ImportOptions("right_tool", posture={"left_follow": 0.2}), "which follows left_grip"),
        (
            ImportOptions("right_tool", rotor_inertia={"neck": 0.2}),
            "--rotor-inertia: names 'neck', which is no joint of",
        ),
    ],
)
def test_a_bad_option_is_refused_in_one_line(tmp_path: Path, options: ImportOptions, said: str) -> None:
    assert said in refuse(write_urdf(tmp_path), options)


def test_values_for_joints_must_be_numbers_within_their_bounds() -> None:
    def parse(*words: str, may_be_zero: bool = True) -> dict[str, float]:
        return parse_spread("--option", list(words), unit="N m", may_be_zero=may_be_zero)

    assert parse("0.1", "elbow=0.2") == {"": 0.1, "elbow": 0.2}
    assert parse("0") == {"": 0.0}
    for words, may_be_zero, said in (
        (("elbow=-1",), True, "--option: is -1 for elbow, must be at least 0 N m"),
        (("0",), False, "--option: is 0, must be more than 0 N m"),
        (("elbow=heavy",), True, "is 'elbow=heavy', must be JOINT=VALUE"),
        (("heavy",), True, "is 'heavy', must be a number or JOINT=VALUE"),
        (("nan",), True, "is 'nan', must be a number or JOINT=VALUE"),
    ):
        with pytest.raises(AffordanceError) as caught:
            parse(*words, may_be_zero=may_be_zero)
        assert said in str(caught.value)


def test_a_tip_that_two_models_share_is_asked_for_by_its_full_name(tmp_path: Path) -> None:
    path = tmp_path / "twins.sdf"
    model = SDF.removeprefix('<sdf version="1.9">').removesuffix("</sdf>")
    twin = model.replace('name="swinger"', 'name="other"')
    path.write_text(f'<sdf version="1.9"><world name="w">{model}{twin}</world></sdf>')
    text = refuse(path, ImportOptions("grip"))
    assert "has more than once: other::grip, swinger::grip" in text
    assert extract_arm(path, ImportOptions("other::grip")).arm.joint_names == ["pan", "tilt", "bend"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<effort>20</effort>", "", "joint bend: has no limit of torque (effort)"),
        ("<effort>20</effort>", "<effort>-1</effort>", "joint bend: has no limit of torque (effort)"),
        ("<lower>-3</lower>", "<lower>nan</lower>", "joint pan.axis.limit.lower: is 'nan', must be a number"),
        ("<lower>-3</lower>", "<lower>4</lower>", "joint pan: has position limits from 4 to 3 rad, must be a range"),
        (
            "<velocity>2</velocity><effort>20",
            "<velocity>fast</velocity><effort>20",
            "joint bend.axis.limit.velocity: is",
        ),
        ("<friction>0.7</friction>", "<damping>-1</damping>", "joint pan: has a damping of -1 N m s/rad"),
        ("<xyz>0 0 1</xyz>", "<xyz>0 0 0</xyz>", "joint pan: has an axis of zero length"),
        ('<link name="wrist">', '<link name="upper">', "link upper: is there twice"),
        ("<velocity>2</velocity><effort>20", "<velocity>0</velocity><effort>20", "joint bend: has a velocity limit"),
        ("<mass>0.5</mass>", "<mass>half</mass>", "link wrist.inertial.mass: is 'half', must be a finite number"),
        ("<mass>0.5</mass>", "<mass>0</mass>", "link wrist: has a mass of 0 kg with moments of inertia"),
        ('type="revolute"><parent>lower', 'type="ball"><parent>lower', "joint bend: is of type"),
    ],
)
def test_a_bad_sdf_is_refused_in_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in SDF
    path = tmp_path / "bad.sdf"
    path.write_text(SDF.replace(old, new))
    assert said in refuse(path, ImportOptions("grip", "foot"))


def test_an_sdf_link_of_the_arm_without_inertial_is_refused_and_not_taken_for_a_kilogram(tmp_path: Path) -> None:
    path = tmp_path / "bare.sdf"
    start = SDF.index("<inertial><mass>0.5")
    path.write_text(SDF[:start] + SDF[SDF.index("</inertial>", start) + len("</inertial>") :])
    assert "link wrist: has no <inertial>, for which SDF puts 1 kg" in refuse(path, ImportOptions("grip"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('forcerange="-8 7"', "", "joint a3: has no limit of torque (effort)"),
        (
            '<inertial pos="0.05 0 0" mass="0.4" diaginertia="0.001 0.0012 0.0013"/>',
            '<geom type="mesh" mesh="m"/>',
            "link third: takes its inertia from the mesh m, must have an <inertial>",
        ),
        ('mass="0.4"', 'mass="0"', "link third: has a mass of 0 kg"),
        ('diaginertia="0.001 0.0012 0.0013"', 'diaginertia="0 0 0"', "makes no arm that Drake takes: "),
        ('range="-2 2"', 'range="2 -2"', "joint a1: has position limits from 2 to -2 rad, must be a range"),
        (
            '<joint damping="0.1"',
            '<joint damping="-1"',
            "joint a1: has a damping of -1 N m s/rad, must be at least 0",
        ),
        ('axis="0 1 0.1"', 'axis="0 0 0"', "joint a4: has an axis of zero length"),
        ('forcerange="-8 7"', 'forcerange="8 -7"', "actuator a3.forcerange: is from 8 to -7, must rise"),
        ('name="a2"', 'name="a1"', "joint a1: is there twice"),
        ('body name="second"', 'body name="first"', "body first: is there twice"),
        (
            'class="strong" joint="a4"',
            'class="strog" joint="a4"',
            "motor.class: is 'strog', must be one of main, strong; did you mean 'strong'?",
        ),
        (
            'joint="a3"',
            'joint="aa3"',
            "actuator aa3.joint: is 'aa3', which is no joint of the file; did you mean 'a3'?",
        ),
        (
            "<worldbody>",
            '<compiler angle="radians"/><worldbody>',
            "compiler.angle: is 'radians', must be one of radian, degree; did you mean 'radian'?",
        ),
    ],
)
def test_a_bad_mjcf_is_refused_in_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in MJCF
    path = tmp_path / "bad.xml"
    path.write_text(MJCF.replace(old, new))
    assert said in refuse(path, ImportOptions("grip_site"))


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    assert "cannot be read: No such file" in refuse(tmp_path / "none.urdf")


def test_a_joint_that_turns_nothing_is_refused(tmp_path: Path) -> None:
    massless = {'<joint name="right_j4" type="continuous">': '<joint name="right_j4" type="continuous">'}
    text = write_urdf(tmp_path, changes=massless).read_text()
    for name in ("right_4", "right_finger", "right_thumb"):
        start = text.index(f'<link name="{name}">')
        end = text.index("</inertial>", start) + len("</inertial>")
        text = text[: start + len(f'<link name="{name}">')] + text[end:]
    path = tmp_path / "light.urdf"
    path.write_text(text)
    assert "joint right_j4: moves nothing that has inertia" in refuse(path)
    assert extract_arm(path, ImportOptions("right_tool", rotor_inertia={"right_j4": 0.01})).arm.links[3].rotor_inertia


def test_a_file_that_takes_in_others_is_refused(tmp_path: Path) -> None:
    """Drake would look for them anywhere, and on the network."""
    path = tmp_path / "a.sdf"
    for uri in ("package://drake_models/ur3e/ur3e_cylinder.sdf", "file:///etc/passwd", "model://x"):
        path.write_text(SDF.replace("<link", f"<include><uri>{uri}</uri></include><link", 1))
        assert "a.sdf: include: is not read here, must be written out" in refuse(path)


def test_a_robot_of_thousands_of_links_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "long.urdf"
    path.write_text(f'<robot name="x">{"".join(f"<link name={str(k)!r}/>" for k in range(1001))}</robot>')
    assert "long.urdf: has 1001 links and joints, must have at most 1000" in refuse(path)


def test_an_arm_without_length_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "short.urdf"
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    path.write_text(
        f'<robot name="x"><link name="a"/><link name="b">{inertial}</link><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="9"/>'
        "</joint></robot>"
    )
    assert "short.urdf: has its tip on its first joint's axis, must have a length" in refuse(path, ImportOptions("b"))
