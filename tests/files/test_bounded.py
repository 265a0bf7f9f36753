"""Files of strangers: what is larger than its kind, no regular file, or more YAML than settings need is refused.

The answer is one line that names the place.
"""

import os

import pytest
from helpers.refusals import refuse

from affordance.exceptions import BadValueError
from affordance.files import bounded
from affordance.files.bounded import SETTINGS, check_yaml, read_bytes, read_json, read_text, read_yaml


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


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "file.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" * 50_000, "is not YAML: maximum recursion depth exceeded"),
        ("- " * 50_000, "is not YAML: maximum recursion depth exceeded"),
        ("a: " + "9" * 5000, "is not YAML: Exceeds the limit (4300 digits)"),
        ("a: !!python/object/apply:os.system [exit]", "could not determine a constructor for the tag"),
        ("a: 1\nb: 2\na: 3", "line 3, column 1: is not YAML: the key 'a' twice"),
        ("[1]: 2", "is not YAML: found unhashable key"),
        ("a: !!int x", "is not YAML: invalid literal for int"),
        ("a: 2001-99-99", "is not YAML: month must be in 1..12"),
        ("a: 1\n---\nb: 2", "is not YAML: but found another document"),
    ],
)
def test_what_is_too_much_or_no_yaml_is_one_line(write, text, problem):
    said = refuse(read_yaml, write(text))
    assert f"file.yaml: {problem}" in said or problem in said


def test_aliases_that_stand_for_little_are_read(write):
    assert read_yaml(write("a: &a [1, 2]\nb: *a\nc: [*a, *a]")) == {"a": [1, 2], "b": [1, 2], "c": [[1, 2], [1, 2]]}


def test_keys_are_not_compared_each_with_each(write, monkeypatch):
    """Reading 300 keys takes fewer than 3000 comparisons; by pairs, 30000 keys took half a minute."""
    compared = []

    class Key(str):
        __slots__ = ()
        __hash__ = str.__hash__

        def __eq__(self, other):
            compared.append(other)
            return str(self) == str(other)

    monkeypatch.setattr(bounded._Loader, "construct_scalar", lambda self, node: Key(node.value))
    assert len(read_yaml(write("\n".join(f"key{i}: x" for i in range(300))))) == 300
    assert len(compared) < 3000


def test_files_of_other_programs_may_have_tags_of_their_own(write):
    check_yaml(write("a: !Rpy {deg: [0, 0, 1]}"))
    for text in ("a: [", "[" * 5000):
        with pytest.raises(BadValueError):
            check_yaml(write(text))


def test_prose_in_yaml_may_have_lines_and_wide_spaces(write):
    assert read_yaml(write("a: |\n  one\u00a0m\n  two\n")) == {"a": "one\u00a0m\ntwo\n"}
