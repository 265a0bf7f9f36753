"""Damaged files that the program wrote and reads again are set aside or refused in one line, and never waited for."""

import os
import signal
from contextlib import contextmanager

import numpy as np
import pytest
import xarray as xr
from helpers.refusals import refuse
from helpers.robot_files import write_urdf
from matplotlib.figure import Figure

from affordance.exceptions import BadValueError
from affordance.extensions.people.fit import GROUPS, read_fit, write_fit
from affordance.extensions.robots import kept, report
from affordance.extensions.robots.importer import ImportOptions
from affordance.extensions.robots.kept import import_kept
from affordance.plant.load import load_arm
from affordance.reporting.report import write_report, write_section
from affordance.reporting.section import ReportFigure, Section


@contextmanager
def within(seconds):
    """Fails a test that waits, as for a pipe."""

    def stop(*_):
        pytest.fail("waits")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path):
    path.write_bytes(b"")


def replace_by_pipe(path):
    path.unlink()
    os.mkfifo(path)


def remove(path):
    path.unlink()


DAMAGES = [cut, empty, replace_by_pipe, remove]


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", ["section.json", "metrics.json", "figure.png"])
def test_report_shows_what_is_not_damaged(tmp_path, caplog, damage, file):
    for name in ("good", "bad"):
        figures = [ReportFigure(file="figure.png", caption="A figure.")]
        write_section(tmp_path / name, Section(1, name.title(), "All is well.", figures, [], [], []))
        for other in ("metrics.json", "figure.png"):
            (tmp_path / name / other).write_text("{}", encoding="utf-8")
    damage(tmp_path / "bad" / file)
    with within(60):
        page = write_report(tmp_path).read_text(encoding="utf-8")
    assert "Good" in page
    is_told = damage is not remove if file == "section.json" else damage in (replace_by_pipe, remove)
    assert len(caplog.messages) == (is_told and file != "metrics.json")


def name_otherwise(path):
    """Writes a file whose values have other axes."""
    xr.load_dataset(path, engine="scipy").rename(draw="row").to_netcdf(path, engine="scipy")


def write_words(path):
    """Writes a file whose values are words."""
    xr.load_dataset(path, engine="scipy").astype(str).to_netcdf(path, engine="scipy")


@pytest.mark.parametrize("damage", [*DAMAGES, name_otherwise, write_words])
def test_fit_that_is_damaged_is_refused(tmp_path, damage):
    groups = {
        name: xr.Dataset({"push_error": (tuple(sorted(axes)), np.ones((2,) * len(axes)))})
        for name, axes in GROUPS.items()
    }
    write_fit(xr.DataTree.from_dict(groups), tmp_path)
    assert read_fit(tmp_path)["prior"]["push_error"].shape == (2, 2)
    damage(tmp_path / "prior.nc")
    with within(60):
        said = refuse(read_fit, tmp_path, error=BadValueError)
    assert str(tmp_path / "prior.nc") in said


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", ["arm.sdf", "tools/weight.yaml"])
def test_import_that_is_damaged_is_set_aside_and_done_anew(tmp_path, monkeypatch, caplog, damage, file):
    monkeypatch.setattr(kept, "fit_tasks", lambda *_: None)
    monkeypatch.setattr(report, "draw_posture", lambda _: Figure())
    path, root = write_urdf(tmp_path), tmp_path / "kept"
    folder = import_kept(path, ImportOptions("right_tool"), root)
    whole = (folder / file).read_bytes()
    for _ in range(2):  # the second takes the place of the first
        damage(folder / file)
        with within(60):
            assert import_kept(path, ImportOptions("right_tool"), root) == folder
    assert (folder / file).read_bytes() == whole
    assert load_arm(folder / "arm.dmd.yaml").num_joints == 4
    assert len(caplog.messages) == 2
    assert "was changed since it was imported; set aside as" in caplog.text
