"""Messages list the names that a tip can have; a finger counts as no arm."""

from pathlib import Path

import pytest
from helpers.bench_arm import write_bench
from helpers.refusals import refuse
from helpers.robot_files import MJCF, SDF, joint, link, write_urdf
from pydrake.multibody.tree import FrameIndex

from affordance.exceptions import BadValueError
from affordance.extensions.robots.chain import describe_ends, find_chain, list_ends
from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.reader import read_robot
from affordance.extensions.robots.tree import RobotTree, build_tree


def read(path: Path, text: str) -> RobotTree:
    path.write_text(text)
    return build_tree(read_robot(path))


def test_ends_are_hands_tool_frames_and_sites_but_neither_fingers_nor_what_hangs_midway(tmp_path: Path) -> None:
    urdf = build_tree(read_robot(write_urdf(tmp_path)))
    assert list_ends(urdf) == {"right_4": 4, "right_tool": 4, "left_4": 4, "left_tool": 4}
    assert list_ends(read(tmp_path / "a.sdf", SDF)) == {"grip": 3, "wrist": 3}
    mjcf = read(tmp_path / "a.xml", MJCF)
    assert list_ends(mjcf) == {"third": 4}
    assert describe_ends(mjcf) == "limbs end in third (4 joints; sites grip_site)"


def test_link_that_carries_many_sites_is_listed_once_with_some_of_them(tmp_path: Path) -> None:
    sites = "".join(f'<site name="s{k}"/>' for k in range(100))
    tree = read(tmp_path / "a.xml", MJCF.replace('<site name="grip_site" pos="0.1 0 0"/>', sites))
    assert describe_ends(tree) == "limbs end in third (4 joints; sites s0, s1, s2 and 97 more)"
    assert describe_ends(tree, "s50") == "nearest: s50, s5, s0"


def test_frames_that_drake_makes_are_no_tips(tmp_path: Path) -> None:
    tree = read(tmp_path / "a.sdf", SDF)
    frames = [tree.plant.get_frame(FrameIndex(k)).name() for k in range(1, tree.plant.num_frames())]
    made = [name for name in frames if name and name not in ("foot", "upper", "lower", "wrist", "grip")]
    assert len(made) > 2
    for name in made:
        assert "is not in" in refuse(find_chain, tree, name, None) or "is a joint of" in refuse(
            find_chain, tree, name
        )


def test_a_fingertip_is_answered_with_the_hand(tmp_path: Path) -> None:
    """A fingertip is answered with the hand, also if it has joints enough for an arm."""
    fingers = "".join(
        "".join(link(f"{name}_{k}", mass=0.1) for k in range(1, 4))
        + joint(f"{name}_a", "right_4", f"{name}_1")
        + joint(f"{name}_b", f"{name}_1", f"{name}_2")
        + joint(f"{name}_c", f"{name}_2", f"{name}_3")
        for name in ("index", "ring")
    )
    path = write_urdf(tmp_path, changes={'<transmission name="t">': f'{fingers}<transmission name="t">'})
    tree = build_tree(read_robot(path))
    assert "is 'ring_3', which is on a finger of right_4" in refuse(find_chain, tree, "ring_3", None)
    assert [each.name() for each in find_chain(tree, "ring_3", "right_4").joints] == ["ring_a", "ring_b", "ring_c"]
    assert "right_4" in list_ends(tree)


def test_the_base_is_called_the_root_only_where_it_is(tmp_path: Path) -> None:
    tree = read(tmp_path / "a.sdf", SDF)
    assert find_chain(tree, "grip", None).why_base == "it is the robot's root"
    plate = '<link name="plate"><inertial><mass>1</mass></inertial></link>'
    bolt = '<joint name="bolt" type="fixed"><parent>plate</parent><child>foot</child></joint>'
    fixed = f'{plate}{bolt}<joint name="pan"'
    chain = find_chain(read(tmp_path / "b.sdf", SDF.replace('<joint name="pan"', fixed)), "grip", None)
    assert (chain.base.name(), chain.why_base) == ("foot", "no joint between it and the robot's root, plate, moves")


def test_limits_of_torque_that_a_file_lacks_are_given_or_left_below_the_base(tmp_path: Path) -> None:
    """Torque limits of 0, of a turntable or of every joint, are given as options or left out below the base."""
    good = 'lower="-2.5" upper="2.4" velocity="3" effort="40"'
    path = write_urdf(tmp_path)
    text = path.read_text()
    start = text.index(good, text.index('<joint name="right_j1"'))
    path.write_text(text[:start] + good.replace("40", "0") + text[start + len(good) :])
    said = r"--effort right_j1=VALUE sets limits \(N m\), --base right_1 leaves out the joints below it"
    with pytest.raises(BadValueError, match=said):
        read_arm(path, ImportOptions("right_tool"))
    assert len(read_arm(path, ImportOptions("right_tool", base="right_1")).links) == 3
    given = read_arm(path, ImportOptions("right_tool", effort={"right_j1": 55.0}))
    assert [link.effort for link in given.links] == [55.0, 40.0, 40.0, 40.0]
    path = write_urdf(tmp_path, changes={'effort="40"': 'effort="0"'})
    options = ImportOptions("right_tool", effort={"": 20.0, "right_j4": 5.0})
    assert [link.effort for link in read_arm(path, options).links] == [20.0, 20.0, 20.0, 5.0]


@pytest.mark.parametrize(
    ("old", "new", "tip", "said"),
    [
        ("", "", "grip_site", "tip: grip_site, at the end of the longest limb (4 joints); others are third (--tip)"),
        (
            '<site name="grip_site" pos="0.1 0 0"/>',
            "",
            "third",
            "tip: third, at the end of the longest limb (4 joints)",
        ),
        ('site name="grip_site"', 'site name="camera"', "third", "others are camera (--tip)"),
        (
            '<site name="grip_site"',
            '<site name="flange"/><site name="my_tcp"/><site name="imu_tool"/><site name="s"',
            "my_tcp",
            "others are third, flange, imu_tool, s (--tip)",
        ),
    ],
)
def test_tip_is_the_end_of_the_longest_limb(tmp_path: Path, old: str, new: str, tip: str, said: str) -> None:
    arm = read_arm(write_text(tmp_path / "a.xml", MJCF.replace(old, new) if old else MJCF), ImportOptions())
    assert arm.options.tip == tip
    assert said in arm.why_tip


def test_no_tip_is_taken_where_two_limbs_are_the_longest(tmp_path: Path) -> None:
    said = refuse(read_arm, write_urdf(tmp_path), ImportOptions())
    assert "--tip: is missing, must be the link or frame of" in said
    assert "limbs end in right_4 (4 joints), right_tool (4 joints), left_4 (4 joints), left_tool (4 joints)" in said


JAW = link("jaw", mass=0.05) + joint("grip", "flange", "jaw", axis="0 1 0")
# A jaw whose name says nothing: it opens to one side only and is weak.
NAMELESS = link("l7", mass=0.05) + joint("j7", "flange", "l7", limit='lower="0" upper="1.2" velocity="2" effort="2"')
MIMIC = '<mimic joint="a1" multiplier="-1"/>'
FINGERS = "".join(
    link(f"f{name}1", mass=0.04)
    + link(f"f{name}2", mass=0.03)
    + joint(f"{name}1", "flange", f"f{name}1", more=MIMIC if name == "b" else "")
    + joint(f"{name}2", f"f{name}1", f"f{name}2", more=MIMIC)
    for name in "ab"
)
HAND = (
    '<link name="tool0"/><link name="hand"/><link name="grasp_frame"/>'
    + joint("mount", "flange", "tool0", kind="fixed")
    + joint("screwed", "flange", "hand", kind="fixed")
    + joint("between", "hand", "grasp_frame", kind="fixed")
    + link("finger")
    + joint("slide", "hand", "finger", kind="prismatic", limit='lower="0" upper="0.04" effort="5" velocity="1"')
)


@pytest.mark.parametrize(
    ("gripper", "tip", "said"),
    [
        (JAW, "flange", "tip: flange, at the end of the longest limb (6 joints); grip moves a jaw and is frozen"),
        (JAW.replace("jaw", "l7"), "flange", "; grip moves a jaw and is frozen"),
        (JAW.replace("grip", "j7"), "flange", "; j7 moves a jaw and is frozen"),
        (JAW.replace("jaw", "l7").replace("grip", "grip_roll"), "l7", "limb (7 joints); there are no others"),
        (JAW.replace("jaw", "l7").replace("grip", "j7"), "l7", "limb (7 joints); there are no others"),
        (NAMELESS, "flange", "tip: flange, at the end of the longest limb (6 joints); j7 moves a jaw and is frozen"),
        (NAMELESS.replace('upper="1.2"', 'upper="2.4"'), "l7", "limb (7 joints); there are no others"),
        (NAMELESS.replace('lower="0"', 'lower="-1.2"'), "l7", "limb (7 joints); there are no others"),
        (NAMELESS.replace('effort="2"', 'effort="40"'), "l7", "limb (7 joints); there are no others"),
        (NAMELESS.replace("j7", "wrist_roll"), "l7", "limb (7 joints); there are no others"),
        (FINGERS, "flange", "tip: flange, at the end of the longest limb (6 joints); there are no others"),
        (HAND, "grasp_frame", "tip: grasp_frame, at the end of the longest limb (6 joints); others are hand, tool0"),
    ],
)
def test_a_gripper_is_no_part_of_the_arm(tmp_path: Path, gripper: str, tip: str, said: str) -> None:
    path = write_bench(tmp_path, ("</robot>", f"{gripper}</robot>"))
    arm = read_arm(path, ImportOptions())
    assert arm.options.tip == tip
    assert said in arm.why_tip


def test_a_jaw_is_no_tip_unless_a_base_is_given(tmp_path: Path) -> None:
    path = write_bench(tmp_path, ("</robot>", f"{JAW}</robot>"))
    said = "is 'jaw', which is on a finger of flange, must be a link that no finger moves: flange?"
    assert said in refuse(read_arm, path, ImportOptions("jaw"))
    assert len(read_arm(path, ImportOptions("jaw", base="pedestal")).links) == 7


def write_text(path: Path, text: str) -> Path:
    path.write_text(text)
    return path
