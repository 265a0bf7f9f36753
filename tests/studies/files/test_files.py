"""The study of files, on a folder of small robots."""

from pathlib import Path

import pytest
from helpers.bench_arm import write_bench
from helpers.refusals import refuse
from helpers.robot_files import write_urdf

from studies.files.command import HEADER, build_row, list_files
from studies.files.examine import examine


@pytest.fixture
def robots(tmp_path: Path) -> Path:
    """Folder with an arm in two formats, a robot with two arms and no limits, one without an arm, and a macro."""
    write_bench(tmp_path)
    write_bench(tmp_path, mjcf=True)
    (tmp_path / "two").mkdir()
    write_urdf(tmp_path / "two", changes={'effort="40"': 'effort="0"'})
    (tmp_path / "stick.urdf").write_text('<robot name="s"><link name="a"/></robot>')
    (tmp_path / "notes.xml").write_text("<package/>")
    (tmp_path / "macro.xacro").write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"/>')
    (tmp_path / "uses.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="u"><xacro:include filename="macro.xacro"/></robot>'
    )
    return tmp_path


def test_every_robots_file_is_listed_once(robots: Path) -> None:
    names = [path.name for path in list_files(robots, [])]
    assert names == ["bench.urdf", "bench.xml", "stick.urdf", "two_arms.urdf", "uses.xacro"]
    assert [path.name for path in list_files(robots, ["bench"])] == ["bench.urdf", "bench.xml"]
    assert "which has no robot file" in refuse(list_files, robots / "no", [])


@pytest.mark.parametrize(("name", "against"), [("bench.urdf", "Pinocchio"), ("bench.xml", "MuJoCo")])
def test_arm_that_loads_has_parity_and_advice(robots: Path, name: str, against: str) -> None:
    found = examine(robots / name, name)
    assert (found.joints, found.options, found.refused, found.against) == (6, "", "", against)
    assert found.parity is not None
    assert found.parity < 1e-9
    assert found.hammer.startswith(("Take the ", "affordance: no tool can do the task"))
    assert len(build_row(found)) == len(HEADER)


def test_options_that_messages_name_are_given(robots: Path) -> None:
    found = examine(robots / "two" / "two_arms.urdf", "two")
    assert (found.joints, found.options) == (4, "--tip right_4 --effort 100")


def test_file_that_does_not_load_has_its_message(robots: Path) -> None:
    found = examine(robots / "stick.urdf", "stick")
    assert (found.joints, found.hammer) == (0, "")
    assert "has no joint that moves" in found.refused
