"""Options of an import that do not fit the robot's file are refused with what the file has."""

from pathlib import Path
from typing import Any

import pytest
from helpers.refusals import refuse
from helpers.robot_files import write_urdf

from affordance.exceptions import AffordanceError
from affordance.extensions.robots.importer import ImportOptions, extract_arm

LIMBS = "limbs end in right_4 (4 joints), right_tool (4 joints), left_4 (4 joints), left_tool (4 joints)"


@pytest.mark.parametrize(
    ("tip", "said"),
    [
        ("", f"is missing, must be the link or frame of {{file}} that holds objects; {LIMBS}"),
        ("rigt_tool", "is 'rigt_tool', which is not in {file}; nearest: right_tool, left_tool, right_4"),
        ("right_tol", "is 'right_tol', which is not in {file}; nearest: right_tool, right_4, left_tool"),
        ("right_j1_parent", "is 'right_j1_parent', which is not in {file}; nearest: right_tool, right_4"),
        ("flange", f"is 'flange', which is not in {{file}}; {LIMBS}"),
        (
            "right_finger",
            "is 'right_finger', which is on a finger of right_4, must be a link that no finger moves: right_4? To"
            " import the finger as an arm, give a --base",
        ),
        (
            "right_thumb",
            "is 'right_thumb', which is on a finger of right_4, must be a link that no finger moves: right_4? To"
            " import the finger as an arm, give a --base",
        ),
        ("right_j2", "is 'right_j2', which is a joint of {file}, must be a link: right_2?"),
        ("pelvis", "is 'pelvis', with no revolute joint between it and world"),
    ],
)
def test_tip_that_holds_nothing_is_refused_with_those_that_do(tmp_path: Path, tip: str, said: str) -> None:
    path = write_urdf(tmp_path)
    assert refuse(extract_arm, path, ImportOptions(tip)) == f"--tip: {said.format(file=path)}"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"base": "left_1"}, "--base: is 'left_1', which is not above right_tool, must be one of"),
        ({"base": "tors"}, "nearest: torso"),
        ({"base": "pelvis"}, "joint lift: is of type prismatic, must be revolute"),
        (
            {"base": "right_2"},
            "has no posture of its 2 joints (right_j3, right_j4) with the hand level and pointing away from the"
            " shoulder; give one with --posture, or another --out-axis, or more joints with --base",
        ),
        ({"out_axis": "up"}, "--out-axis: is 'up', must be one of x, y, z, -x, -y, -z"),
        ({"posture": {"nek": 0.1}}, "--posture: names 'nek', which is not a moving joint of"),
        ({"posture": {"neck": 7.0}}, "--posture: sets neck to 7, must be from -2.5 to 2.4"),
        ({"posture": {"left_follow": 0.2}}, "which follows left_grip"),
        ({"rotor_inertia": {"neck": 0.2}}, "--rotor-inertia: names 'neck', which is not a joint of"),
    ],
)
def test_option_that_does_not_fit_the_file_is_refused(tmp_path: Path, options: dict[str, Any], said: str) -> None:
    path = write_urdf(tmp_path)
    assert said in refuse(extract_arm, path, ImportOptions("right_tool", **options), error=AffordanceError)
