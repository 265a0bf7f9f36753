"""What the report of an import says of the robot's file."""

from pathlib import Path

import pytest
from helpers.robot_files import write_urdf

from affordance.extensions.robots.importer import ImportOptions, read_arm
from affordance.extensions.robots.report import list_dropped


@pytest.mark.parametrize("damping", [True, False])
def test_damping_is_reported_as_left_out_only_on_request(tmp_path: Path, damping: bool) -> None:
    arm = read_arm(write_urdf(tmp_path), ImportOptions("right_tool", damping=damping))
    assert any(link.damping > 0.0 for link in arm.links) == damping
    assert ("damping of all joints, as requested" in list_dropped(arm)) == (not damping)
