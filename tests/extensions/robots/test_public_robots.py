"""Imports robots that their makers publish, if a folder with their files is given.

``AFFORDANCE_ROBOTS`` is the folder into which example-robot-data was installed, or its folder of robots.
"""

import os
import site
from pathlib import Path

import pytest
from helpers.pinocchio_parity import compute_parity
from helpers.public_robots import ROBOTS, PublicRobot, find_folder

from affordance.extensions.robots.kept import import_arm


def find_robots() -> Path | None:
    folders = [Path(os.environ["AFFORDANCE_ROBOTS"])] if "AFFORDANCE_ROBOTS" in os.environ else []
    folders += [Path(folder) for folder in site.getsitepackages()]
    return next((find_folder(folder) for folder in folders if (find_folder(folder) / ROBOTS[0].file).is_file()), None)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_public_robot_is_imported_and_agrees_with_pinocchio(tmp_path: Path, robot: PublicRobot) -> None:
    folder = find_robots()
    if folder is None:
        pytest.skip("example-robot-data is neither installed nor where AFFORDANCE_ROBOTS says")
    pytest.importorskip("pinocchio")
    path = folder / robot.file
    import_arm(path, robot.options, tmp_path / "arm", with_meshes=False, fits_tasks=False)
    assert (tmp_path / "arm" / "arm.sdf").is_file()
    assert compute_parity(path, robot.options).largest < 1e-9
