"""Findings of an import are kept for as long as they hold."""

from pathlib import Path

import pytest

from affordance.files.lacks import LACKS, read_lacks, write_lacks

FOUND = {"path": "stick by wood leaves the path by 0.05 m: 'too far'", "blow": "the tip must strike with 5 m/s"}


@pytest.fixture
def models(tmp_path: Path) -> Path:
    for name in ("arm.sdf", "arm.dmd.yaml", "nail.yaml", "paths/reach.yaml", "report.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    return tmp_path


def test_lacks_are_read_as_they_were_written(models: Path) -> None:
    write_lacks(models, FOUND)
    (models / "report.txt").write_text("written later, and decides nothing")
    assert read_lacks(models) == FOUND


def test_an_arm_that_can_do_everything_leaves_no_file(models: Path) -> None:
    write_lacks(models, {})
    assert not (models / LACKS).exists()
    assert read_lacks(models) == {}


@pytest.mark.parametrize("name", ["arm.sdf", "nail.yaml", "paths/reach.yaml", "tools/novel.yaml"])
def test_lacks_are_forgotten_once_a_file_that_decides_was_changed(models: Path, name: str) -> None:
    write_lacks(models, FOUND)
    (models / name).parent.mkdir(exist_ok=True)
    (models / name).write_text("changed")
    assert read_lacks(models) == {}


@pytest.mark.parametrize("text", ["", "tasks: [", "tasks: 3", "- 1", "tasks: {path: far}", "\0"])
def test_a_damaged_file_says_nothing(models: Path, text: str) -> None:
    (models / LACKS).write_text(text)
    assert read_lacks(models) == {}
