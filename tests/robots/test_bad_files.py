"""Every mistake in a robot's file or options is answered by one line that names file or option and place."""

import math
import re
from pathlib import Path

import pytest
from helpers.robot_files import SDF, write_urdf

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


def test_what_is_wrong_with_a_joint_of_another_limb_is_left_out_and_named(tmp_path: Path) -> None:
    """Limits of the neck, with which Drake would end the program whatever the arm, are left out and named."""
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
    """A continuous joint has infinite limits; a bound that another joint's file leaves out is 0, as in URDF."""
    path = write_urdf(tmp_path, changes={'lower="-2.5" upper="2.4"': 'upper="2.4"'})
    *others, last = extract_arm(path, TIP).arm.links
    assert (last.lower, last.upper) == (-math.inf, math.inf)
    assert [(link.lower, link.upper) for link in others] == [(0.0, 2.4)] * 3


def test_infinite_limits_are_none(tmp_path: Path) -> None:
    limits = {'lower="-2.5" upper="2.4" velocity="3"': 'lower="-inf" upper="inf" velocity="inf"'}
    for link in extract_arm(write_urdf(tmp_path, changes=limits), TIP).arm.links:
        assert (link.lower, link.upper, link.velocity) == (-math.inf, math.inf, math.inf)


def test_prefixes_that_were_never_declared_are_read(tmp_path: Path) -> None:
    """Undeclared XML prefixes, as simulators' own elements have them, are read."""
    block = '<gazebo reference="torso"><sensor:camera a:b="1" xml:lang="en"/></gazebo>'
    path = write_urdf(tmp_path, changes={"<gazebo/>": block})
    assert len(extract_arm(path, TIP).arm.links) == 4
    path = write_urdf(tmp_path, changes={"<gazebo/>": block.replace("</gazebo>", "")})
    assert "is not XML: mismatched tag" in refuse(path)


def test_what_a_fixed_joint_says_of_its_axis_does_not_matter(tmp_path: Path) -> None:
    """A fixed joint with a zero axis, as CAD programs write it, and a robot without a name are read."""
    fixed = '<parent link="right_4"/><child link="right_tool"/><origin xyz="0.1 0 0" rpy="0.1 -0.2 0.05"/><axis xyz="'
    changes = {f"{fixed}0 1 0": f"{fixed}0 0 0", '<robot name="two_arms">': "<robot>"}
    imported = extract_arm(write_urdf(tmp_path, changes=changes), TIP)
    assert not any("limits of the joint" in note for note in list_dropped(imported))


def test_a_robot_without_masses_is_refused(tmp_path: Path) -> None:
    """A file that states where links are and no masses, as many files for planning do, is refused."""
    path = write_urdf(tmp_path)
    path.write_text(re.sub(r"<inertial>.*?</inertial>", "", path.read_text()))
    assert refuse(path).endswith(
        "two_arms.urdf: has no mass for any link of the arm, must have inertias (<inertial>)"
    )


def test_mimic_and_prismatic_end_a_chain_but_not_one_that_names_its_base(tmp_path: Path) -> None:
    path = write_urdf(tmp_path)
    assert extract_arm(path, TIP).arm.base == "torso"
    assert "joint lift: is of type prismatic, must be revolute" in refuse(path, ImportOptions("right_tool", "pelvis"))


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


def test_an_sdf_link_of_the_arm_without_inertial_is_refused_and_not_taken_for_a_kilogram(tmp_path: Path) -> None:
    path = tmp_path / "bare.sdf"
    start = SDF.index("<inertial><mass>0.5")
    path.write_text(SDF[:start] + SDF[SDF.index("</inertial>", start) + len("</inertial>") :])
    assert "link wrist: has no <inertial>, for which SDF puts 1 kg" in refuse(path, ImportOptions("grip"))


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
    """A file that includes others is refused, as Drake would look for them anywhere, and on the network."""
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
