"""Files are read whole; a file larger than its kind, or no regular file, is refused."""

import os

import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.files.bounded import SETTINGS, read_bytes, read_json, read_text


def test_files_up_to_the_bound_are_read(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"a\r\nb\rc\n" + b"x" * 93)
    assert len(read_bytes(path, 100)) == 100
    assert read_text(path, 100).startswith("a\nb\nc\nx")
    assert refuse(read_bytes, path, 99).endswith("file: has 0.0001 MB, must have at most 9.9e-05 MB")


def test_size_is_looked_at_before_anything_is_read(tmp_path):
    """A sparse file of a terabyte is refused by its size, without being read."""
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(10**12)
    assert "has 1e+06 MB, must have at most 1 MB" in refuse(read_text, path, SETTINGS)


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda path: None, "cannot be read: No such file"),
        (lambda path: path.mkdir(), "cannot be read: Is a directory"),
        (lambda path: os.mkfifo(path), "cannot be read: it is a device, a pipe or a socket"),
        (lambda path: path.symlink_to("/dev/zero"), "cannot be read: it is a device, a pipe or a socket"),
        (lambda path: path.symlink_to(path), "cannot be read: Too many levels"),
        (lambda path: path.write_bytes(b"\xff\xfe"), "is not a text file in UTF-8"),
    ],
)
def test_what_is_no_text_is_one_line(tmp_path, make, problem):
    make(tmp_path / "file")
    with pytest.raises(BadValueError, match=problem):
        read_text(tmp_path / "file", 100)


def test_impossible_names_are_one_line(tmp_path):
    for name in ("a\0b", "a" * 5000):
        assert "cannot be read" in refuse(read_text, tmp_path / name, 100)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "9" * 5000, '{"a": 1} x'])
def test_what_is_not_json_is_one_line(tmp_path, text):
    path = tmp_path / "file.json"
    path.write_text(text, encoding="utf-8")
    assert "file.json: is not JSON: " in refuse(read_json, path)
