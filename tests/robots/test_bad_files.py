"""What a robot's file may say and leave out; mistakes stand in ``system/bad_values/robots.yaml``."""

import math
from pathlib import Path

import pytest
from helpers.refusals import refuse
from helpers.robot_files import write_urdf

from affordance.exceptions import AffordanceError
from affordance.robots.importer import ImportOptions, extract_arm, parse_values, read_arm
from affordance.robots.report import list_dropped

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
