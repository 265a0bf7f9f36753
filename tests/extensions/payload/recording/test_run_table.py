"""Tables of recordings by strangers are read or refused in one line, whatever their content."""

import contextlib

import numpy as np
import pytest
from helpers.refusals import refuse
from scipy.io import netcdf_file

from affordance.exceptions import BadValueError
from affordance.extensions.payload.recording.run_table import read_netcdf, read_text
from affordance.files import bounded


@pytest.fixture
def write(tmp_path):
    def write(content, name="run.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_rows_numbers_and_names_are_as_in_the_file(write):
    table = read_text(write('\ufefftime;"q 1"\r\n0;1.5\r\n\r\n0.1;2e-3\r\n'))
    assert table.names == ("time", "q 1")
    np.testing.assert_array_equal(table.values, [[0.0, 1.5], [0.1, 2e-3]])
    assert table.rows.tolist() == [2, 4]
    table = read_text(write("0  1\n0.1   2\n"))
    assert (table.names, table.rows.tolist()) == ((), [1, 2])
    assert read_text(write("time,q\n")).values.shape == (0, 2)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("time,q\n" + "1," * 60_000, "row 2: is longer than 100000 characters"),
        ('time,q\n"' + "x" * 140_000, "row 2: is longer than 100000 characters"),
        ('time,q\n0,1\n"' + "1\n" * 60_000, "row 3: is longer than 100000 characters"),
        ("time,q\n0,\0\n", "row 2, column q: is '\\x00', must be a number"),
        ("", "is empty"),
        ("\n\n", "is empty"),
        (b"\x80\x81", "is not a text file in UTF-8"),
        ("time,q\n" + "1" * 5000 + ",x\n", "row 2, column q: is 'x', must be a number"),
        ("time,q\n0,abcdefghijklmnopqrstuvwxyzabcdefghij\n", "is 'abcdefghijklmnopqrstuvwxyzabcd', must be"),
        ("time,q\n0,1\n0.1,nan\n", "row 3, column q: is nan, must be a finite number"),
        ("time,q\n0,1\n0.1,2,3\n", "row 3: has 3 values, must have 2"),
    ],
)
def test_text_that_is_no_table_is_one_line(write, content, problem):
    said = refuse(read_text, write(content))
    assert "run.csv" in said
    assert problem in said


def test_recordings_are_bounded_in_size(write, monkeypatch):
    monkeypatch.setattr(bounded, "RECORDING", 1000)
    for read in (read_text, read_netcdf):
        assert "has 0.002 MB, must have at most 0.001 MB" in refuse(read, write("1,2\n" * 500))


def make_netcdf(path, length=5):
    with netcdf_file(path, "w") as file:
        file.createDimension("time", length)
        for name in ("time", "q_1"):
            file.createVariable(name, "d", ("time",))[:] = np.arange(length, dtype=float)
    return path.read_bytes()


def test_netcdf_whose_head_promises_more_than_it_holds_is_one_line(tmp_path, write):
    good = make_netcdf(tmp_path / "good.nc")
    assert set(read_netcdf(tmp_path / "good.nc").names) == {"time", "q_1"}
    promise = good.replace(b"time\x00\x00\x00\x05", b"time\x7f\xff\xff\xff")
    assert promise != good
    assert "is not a netCDF 3 file of numbers: " in refuse(read_netcdf, write(promise, "huge.nc"))


def test_netcdf_whose_variables_share_their_numbers_is_one_line(tmp_path, write):
    """A netCDF file whose variables share one block of numbers, and would take 100 times its memory, is refused."""
    good = make_netcdf(tmp_path / "good.nc", 50)
    with netcdf_file(tmp_path / "many.nc", "w") as file:
        file.createDimension("time", 50)
        for number in range(100):
            file.createVariable(f"q{number:03}", "d", ("time",))
    head = (tmp_path / "many.nc").read_bytes()[: -100 * 400]
    assert len(head) + len(good) < 100 * 50 * 8
    assert "shared.nc" in refuse(read_netcdf, write(head + good, "shared.nc"))


@pytest.mark.parametrize("place", range(0, 190, 7))
def test_damaged_netcdf_is_read_or_refused(tmp_path, write, place):
    good = bytearray(make_netcdf(tmp_path / "good.nc"))
    for value in (0, 0x7F, 0xFF):
        good[place] = value
        with contextlib.suppress(BadValueError):
            read_netcdf(write(bytes(good), "bad.nc"))


def test_variables_without_a_sample_for_each_time_are_named(tmp_path):
    path = tmp_path / "run.nc"
    with netcdf_file(path, "w") as content:
        content.createDimension("time", 3)
        content.createDimension("joint", 2)
        content.createVariable("time", "d", ("time",))[:] = np.arange(3.0)
        content.createVariable("q", "d", ("joint", "time"))[:] = np.zeros((2, 3))
    assert r"q: has shape (2, 3), must have the 3 samples of time" in refuse(read_netcdf, path)
